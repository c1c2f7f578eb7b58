// PCL: normals with OpenMP, and point-to-plane ICP on a voxel grid.
#include <pcl/common/io.h>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/pcl_config.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>

#include <cstdint>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Oriented = pcl::PointCloud<pcl::PointNormal>;

extern "C" const char* version() { return PCL_VERSION_PRETTY; }

extern "C" Cloud::Ptr* load(const float* xyz, std::int64_t size) {
  Cloud::Ptr cloud(new Cloud);
  cloud->reserve(static_cast<std::size_t>(size));
  for (std::int64_t i = 0; i < size; ++i) cloud->push_back({xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]});
  return new Cloud::Ptr(cloud);
}

extern "C" void release(Cloud::Ptr* cloud) { delete cloud; }

static pcl::PointCloud<pcl::Normal> normals_of(const Cloud::Ptr& cloud, int k, int threads) {
  pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimation(static_cast<unsigned>(threads));
  estimation.setInputCloud(cloud);
  estimation.setKSearch(k);
  pcl::PointCloud<pcl::Normal> normals;
  estimation.compute(normals);
  return normals;
}

extern "C" pcl::PointCloud<pcl::Normal>* normals(const Cloud::Ptr* cloud, int k, int threads) {
  return new pcl::PointCloud<pcl::Normal>(normals_of(*cloud, k, threads));
}

extern "C" void unload(pcl::PointCloud<pcl::Normal>* normals, float* out) {
  for (const pcl::Normal& normal : *normals) {
    for (int axis = 0; axis < 3; ++axis) *out++ = normal.normal[axis];
  }
  delete normals;
}

static Oriented::Ptr oriented(const Cloud::Ptr& cloud, float voxel, int k, int threads) {
  Cloud::Ptr thin(new Cloud);
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(cloud);
  grid.setLeafSize(voxel, voxel, voxel);
  grid.filter(*thin);
  Oriented::Ptr result(new Oriented);
  pcl::concatenateFields(*thin, normals_of(thin, k, threads), *result);
  return result;
}

// target_from_source, row by row.
extern "C" void align(const Cloud::Ptr* source, const Cloud::Ptr* target, double voxel, double max_distance,
                      int iterations, int threads, float* out) {
  pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
  icp.setInputSource(oriented(*source, static_cast<float>(voxel), 16, threads));
  icp.setInputTarget(oriented(*target, static_cast<float>(voxel), 16, threads));
  icp.setMaxCorrespondenceDistance(max_distance);
  icp.setMaximumIterations(iterations);
  Oriented moved;
  icp.align(moved);
  Eigen::Map<Eigen::Matrix<float, 4, 4, Eigen::RowMajor>>(out, 4, 4) = icp.getFinalTransformation();
}
