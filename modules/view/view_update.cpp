#include "modules/view/view_update.hpp"

#include <stdexcept>
#include <utility>

#include "modules/core/data/byte_archive.hpp"
#include "modules/core/data/single_pose.hpp"

namespace km {
namespace {

// Minimum bytes of one element of each list.
constexpr std::size_t kPoseBytes = 7 * sizeof(float);
constexpr std::size_t kClosureBytes = 4 + 1 + 1 + 1 + 1;
constexpr std::size_t kFeatureBytes = 2 * sizeof(float);
constexpr std::size_t kObjectBytes = 1 + 7 * sizeof(float) + 1;
constexpr std::size_t kTripleBytes = 3 * sizeof(std::uint16_t);

bool is_value(std::uint8_t value) {
  return value <= ViewRaster::kFree || value == ViewRaster::kUnknown;
}

void describe_single(auto& archive, As<SE3> auto& T) {
  if constexpr (kReads<decltype(archive)>) {
    SinglePose single;
    archive(single);
    T = is_valid(single) ? single.pose() : SE3::Identity();
  } else {
    archive(SinglePose::of(T));
  }
}

void describe(auto& archive, As<ViewPose> auto& pose) {
  archive(pose.stamp);
  describe_single(archive, pose.T_odom_body);
}

void describe(auto& archive, As<ViewKeyframes> auto& keyframes) {
  archive(keyframes.optimized, keyframes.anchor, keyframes.first);
  archive.list(keyframes.T_world_kf, kMaxViewBytes, kPoseBytes,
               [&](auto& T) { describe_single(archive, T); });
  if (keyframes.optimized) return;
  archive.list(keyframes.stamps, kMaxViewBytes, sizeof(Stamp),
               [&](auto& stamp) { archive(stamp); });
  archive.require(keyframes.stamps.size() == keyframes.T_world_kf.size());
}

void describe(auto& archive, As<ViewClosures> auto& closures) {
  archive.list(closures.closures, kMaxViewBytes, kClosureBytes, [&](auto& closure) {
    archive(closure.id.from, closure.id.to);
    archive.require(!(closure.id.to < closure.id.from));
    archive.choice(closure.verdict, ClosureStatus::kKept);
    archive(closure.matches, closure.inliers);
    archive.printable(closure.reason);
  });
}

void describe(auto& archive, As<MeshChunk> auto& chunk) {
  const auto triples = [&](auto& list) {
    archive.list(list, kMaxViewBytes, kTripleBytes, [&](auto& triple) {
      for (auto& value : triple) archive.fixed(value);
    });
  };
  for (auto& c : chunk.key.cell) archive.fixed(c);
  archive(chunk.key.part, chunk.anchor, chunk.step_m);
  for (auto& c : chunk.origin) archive.fixed(c);
  triples(chunk.offsets);
  archive.list(chunk.labels, kMaxViewBytes, 1, [&](auto& label) { archive(label); });
  archive.list(chunk.colors, kMaxViewBytes, 2, [&](auto& color) { archive.fixed(color); });
  triples(chunk.faces);
  archive.require(fault_of(chunk) == nullptr);
}

void describe(auto& archive, As<ViewImage> auto& image) {
  archive(image.stamp);
  archive.list(image.jpeg, kMaxViewBytes, 1, [&](auto& byte) { archive(byte); });
  archive.list(image.features, kMaxViewBytes, kFeatureBytes,
               [&](auto& feature) { archive(feature[0], feature[1]); });
}

void describe(auto& archive, As<ViewObjects> auto& update) {
  archive(update.anchor, update.left_out);
  archive.list(update.objects, kMaxViewBytes, kObjectBytes, [&](auto& object) {
    archive(object.label, object.center, object.yaw_rad, object.size_m);
    archive.require(object.size_m.minCoeff() >= 0.0F);
    archive.list(object.robots, kMaxViewBytes, 1, [&](auto& robot) { archive(robot); });
  });
}

void describe(auto& archive, As<ViewRaster> auto& raster) {
  archive(raster.anchor, raster.resolution_m, raster.width, raster.height);
  for (auto& x : raster.origin) archive(x);
  archive.list(raster.runs, kMaxViewBytes, 1, [&](auto& byte) { archive(byte); });
  archive.require(is_valid(raster));
}

}  // namespace

bool is_valid(const ViewRaster& raster) {
  const std::uint64_t cells = std::uint64_t{raster.width} * raster.height;
  if (raster.width > ViewRaster::kMaxSide || raster.height > ViewRaster::kMaxSide || cells == 0 ||
      cells > ViewRaster::kMaxCells || !(raster.resolution_m > 0.0F) || raster.runs.size() % 2 != 0)
    return false;
  std::uint64_t sum = 0;
  for (std::size_t k = 0; k < raster.runs.size(); k += 2) {
    if (raster.runs[k] == 0 || !is_value(raster.runs[k + 1])) return false;
    sum += raster.runs[k];
  }
  return sum == cells;
}

std::vector<std::uint8_t> cells_of(const ViewRaster& raster) {
  std::vector<std::uint8_t> cells;
  for (std::size_t k = 0; k < raster.runs.size(); k += 2)
    cells.insert(cells.end(), raster.runs[k], raster.runs[k + 1]);
  return cells;
}

std::vector<std::uint8_t> encode_view(const ViewContent& content) {
  ArchiveWriter archive;
  archive.alternative(content, [&](const auto& c) { describe(archive, c); });
  if (archive.size() > kMaxViewBytes)
    throw std::length_error("view: content of kind " + std::to_string(content.index()) + " has " +
                            std::to_string(archive.size()) + " B, at most " +
                            std::to_string(kMaxViewBytes) + " are allowed");
  return archive.release();
}

std::optional<ViewContent> decode_view(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kMaxViewBytes) return std::nullopt;
  ArchiveReader archive(bytes);
  ViewContent content;
  archive.alternative(content, [&](auto& c) { describe(archive, c); });
  return archive.done() ? std::optional(std::move(content)) : std::nullopt;
}

}  // namespace km
