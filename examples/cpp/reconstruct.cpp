// Grows a model from a folder of depth images and writes it as a PLY file, with nacre and the standard library alone.
//
//   reconstruct FOLDER OUT.ply WIDTH HEIGHT FX FY CX CY DEPTH_SCALE
//
// FOLDER holds one file per image, NAME.raw: WIDTH x HEIGHT unsigned 16-bit integers, little-endian, row by row, in
// name order. DEPTH_SCALE is in stored units per metre; 0 and 65535 mean "no measurement".
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/depth.hpp"
#include "nacre/model.hpp"

namespace {

namespace fs = std::filesystem;

using RawImage = Eigen::Array<std::uint16_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::vector<fs::path> raw_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".raw") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) throw std::runtime_error("no *.raw file in " + folder.string());
  return files;
}

RawImage read_raw(const fs::path& path, int width, int height) {
  RawImage image(height, width);
  std::vector<unsigned char> bytes(2 * static_cast<std::size_t>(image.size()));
  if (fs::file_size(path) != bytes.size()) {
    throw std::runtime_error(path.string() + " must have " + std::to_string(bytes.size()) + " bytes, has " +
                             std::to_string(fs::file_size(path)));
  }
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) {
    throw std::runtime_error("cannot read " + path.string());
  }
  for (Eigen::Index i = 0; i < image.size(); ++i) {
    const std::size_t byte = 2 * static_cast<std::size_t>(i);
    image.data()[i] = static_cast<std::uint16_t>(bytes[byte] | bytes[byte + 1] << 8);
  }
  return image;
}

void write_ply(const fs::path& path, const nacre::PointModel& cloud) {
  std::ofstream file(path);
  file << "ply\nformat ascii 1.0\nelement vertex " << cloud.size() << "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) file << "property float " << name << "\n";
  file << "end_header\n";
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3f &p = cloud.points[i], &n = cloud.normals[i];
    file << p.x() << " " << p.y() << " " << p.z() << " " << n.x() << " " << n.y() << " " << n.z() << "\n";
  }
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

void print(const nacre::FrameReport& report, const fs::path& file) {
  const Eigen::Vector3d position = report.world_from_camera.translation();
  const Eigen::Quaterniond rotation(report.world_from_camera.linear());
  std::printf("%s %-11s position %.4f %.4f %.4f rotation %.4f %.4f %.4f %.4f %s\n", file.stem().string().c_str(),
              nacre::to_string(report.status), position.x(), position.y(), position.z(), rotation.x(), rotation.y(),
              rotation.z(), rotation.w(), report.reason.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 10) {
    std::fprintf(stderr, "usage: %s FOLDER OUT.ply WIDTH HEIGHT FX FY CX CY DEPTH_SCALE\n", argv[0]);
    return 2;
  }
  try {
    const int width = std::stoi(argv[3]), height = std::stoi(argv[4]);
    const nacre::Camera camera = nacre::Camera::pinhole(width, height, std::stod(argv[5]), std::stod(argv[6]),
                                                        std::stod(argv[7]), std::stod(argv[8]));
    const double depth_scale = std::stod(argv[9]);

    nacre::Model model(camera);
    for (const fs::path& file : raw_files(argv[1])) {
      const nacre::DepthImage depth = nacre::depth_from_raw(read_raw(file, width, height), depth_scale);
      print(model.add_frame(depth), file);
    }
    write_ply(argv[2], model.cloud());
    std::printf("%lld points in %s\n", static_cast<long long>(model.cloud().size()), argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "reconstruct: %s\n", error.what());
    return 1;
  }
  return 0;
}
