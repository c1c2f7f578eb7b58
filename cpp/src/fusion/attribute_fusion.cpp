#include "fusion/attribute_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "camera/point_projection.hpp"
#include "fusion/limits.hpp"
#include "fusion/observable.hpp"

namespace nacre {
namespace {

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();
constexpr int planes_at_once = 3;  // channels that the kernel takes at once

PointAttribute* find(PointModel& model, const std::string& name) {
  const auto found = std::find_if(model.attributes.begin(), model.attributes.end(),
                                  [&](const PointAttribute& attribute) { return attribute.name == name; });
  return found == model.attributes.end() ? nullptr : &*found;
}

}  // namespace

void check_attributes(const std::vector<FrameAttribute>& attributes, const Camera& camera, const PointModel& model) {
  const Eigen::Index pixels = static_cast<Eigen::Index>(camera.width()) * camera.height();
  for (const FrameAttribute& attribute : attributes) {
    const std::string name = "attributes['" + attribute.name + "']";
    require(!attribute.name.empty(), "attributes", "named", "an empty name");
    require(std::count_if(attributes.begin(), attributes.end(),
                          [&](const FrameAttribute& other) { return other.name == attribute.name; }) == 1,
            name, "given once", "it more often");
    require(attribute.values.rows() == pixels, name, "one row per pixel", attribute.values.rows());
    require(attribute.values.cols() >= 1, name, "of at least one channel", attribute.values.cols());
    const PointAttribute* const known = find(const_cast<PointModel&>(model), attribute.name);
    require(known == nullptr || known->num_channels == attribute.values.cols(), name,
            "of as many channels as in earlier frames", attribute.values.cols());
  }
}

AttributePlanes::AttributePlanes(const std::vector<FrameAttribute>& attributes, const SurfaceObserver& observer,
                                 const Camera& camera, int num_threads)
    : observer_(observer), plane_size_(observer.plane_size()) {
  for (const FrameAttribute& attribute : attributes) {
    const bool has_gaps = !attribute.values.allFinite();
    const int channels = static_cast<int>(attribute.values.cols());
    parts_.push_back({&attribute, num_planes_, has_gaps ? num_planes_ + channels : -1});
    num_planes_ += channels + (has_gaps ? 1 : 0);
  }
  if (parts_.empty()) return;
  num_planes_ = (num_planes_ + planes_at_once - 1) / planes_at_once * planes_at_once;
  values_.assign(static_cast<std::size_t>(num_planes_ * plane_size_), 0.0F);
  parallel_for(camera.height(), 16, num_threads, [&](std::int64_t v) {
    for (const Part& part : parts_) {
      const Attributes& values = part.attribute->values;
      const auto channels = static_cast<int>(values.cols());
      for (int u = 0; u < camera.width(); ++u) {
        const auto row = values.row(v * camera.width() + u);
        if (!row.allFinite()) continue;
        const auto pixel = static_cast<std::size_t>(observer_.plane_offset(u, static_cast<int>(v)));
        for (int c = 0; c < channels; ++c) {
          values_[static_cast<std::size_t>((part.first + c) * plane_size_) + pixel] = row[c];
        }
        if (part.coverage >= 0) values_[static_cast<std::size_t>(part.coverage * plane_size_) + pixel] = 1.0F;
      }
    }
  });
}

void AttributePlanes::observe(ObservationBlock& block, float* averages) const {
  for (int plane = 0; plane < num_planes_; plane += planes_at_once) {
    observer_.observe_planes(block, values_.data() + plane * plane_size_,
                             averages + plane * ObservationBlock::capacity);
  }
}

void fuse_attributes(PointModel& model, const std::vector<PointRange>& ranges, const RegisteredFrame& now,
                     const AttributePlanes& planes, int num_threads) {
  const SurfaceObserver& observer = now.observer;
  std::vector<PointAttribute*> targets;
  for (const AttributePlanes::Part& part : planes.parts()) {
    if (find(model, part.attribute->name) == nullptr) {
      model.attributes.push_back({part.attribute->name, static_cast<int>(part.attribute->values.cols()), {}});
    }
  }
  for (PointAttribute& attribute : model.attributes) {
    attribute.values.resize(model.points.size() * static_cast<std::size_t>(attribute.num_channels), nothing);
  }
  for (const AttributePlanes::Part& part : planes.parts()) targets.push_back(find(model, part.attribute->name));

  const PointProjection view(now.camera, now.world_from_camera);
  constexpr std::int64_t block_size = PointProjection::capacity;
  parallel_for(static_cast<std::int64_t>(ranges.size()), 1, num_threads, [&](std::int64_t number) {
    const PointRange& range = ranges[static_cast<std::size_t>(number)];
    const std::size_t start = range.first;
    PointProjection::Block points;
    view.project(model.points[start].data(), model.normals[start].data(), range.count, points);
    ObservationBlock block;
    std::size_t seen[block_size];
    for (int j = 0; j < range.count; ++j) {
      if (!is_observable(points, j, now.frame, observer)) continue;
      seen[block.size()] = start + static_cast<std::size_t>(j);
      observer.add(block, points.point(j), points.normal(j), points.pixel[j], sigma_at(now.frame, points.pixel[j]));
    }
    if (block.size() == 0) return;
    std::vector<float> averages(static_cast<std::size_t>(planes.num_planes()) * ObservationBlock::capacity);
    planes.observe(block, averages.data());
    for (int k = 0; k < block.size(); ++k) {
      const float weight = block[k].weight;
      if (!(weight > fusion_limits::least_weight * observer.frontal_weight(block.sigma(k)))) continue;
      const auto average = [&](int plane) {
        return averages[static_cast<std::size_t>(plane * ObservationBlock::capacity + k)];
      };
      for (std::size_t p = 0; p < targets.size(); ++p) {
        const AttributePlanes::Part& part = planes.parts()[p];
        const float coverage = part.coverage < 0 ? 1.0F : average(part.coverage);
        if (!(coverage > 0.0F)) continue;
        const float gain = weight * coverage / (model.confidence[seen[k]] + weight * coverage);
        float* const value = targets[p]->values.data() + seen[k] * static_cast<std::size_t>(targets[p]->num_channels);
        for (int c = 0; c < targets[p]->num_channels; ++c) {
          const float observed = average(part.first + c) / coverage;
          value[c] = std::isfinite(value[c]) ? value[c] + gain * (observed - value[c]) : observed;
        }
      }
    }
  });
}

}  // namespace nacre
