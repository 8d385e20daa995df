#include "modules/mesh/gone_surface.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "modules/mesh/seen_through.hpp"

namespace km {
namespace {

constexpr int kBlock = 8;  // [cells]

struct GonePlace {
  std::array<std::int32_t, 3> block;
  unsigned bit;   // x + 8 y
  std::size_t z;  // word
};

// Precondition: the coordinates fit into 31 bits of cells.
GonePlace place_of(const Eigen::Vector3f& point, float cell_m) {
  const Eigen::Array3i cell = (point.array() / cell_m).floor().cast<int>();
  const auto block = [&cell](int axis) { return cell[axis] >> 3; };
  const auto in_block = [&cell](int axis) { return static_cast<unsigned>(cell[axis] & 7); };
  return {{block(0), block(1), block(2)}, in_block(0) + kBlock * in_block(1), in_block(2)};
}

bool has_cell(const Eigen::Vector3f& point, float cell_m) {
  return (point.array().abs() < 1e9F * cell_m).all();  // false if it is not finite
}

auto order(const GoneBlock& block) {
  return std::tie(block.owner, block.block);
}

// Sets the bits of cells with a vertex that is, or is not, seen through.
class CellMarks {
 public:
  void mark(RobotId owner, const GonePlace& place, bool is_gone) {
    auto& [gone, stays] = blocks_[{owner, place.block}];
    (is_gone ? gone : stays)[place.z] |= std::uint64_t{1} << place.bit;
  }

  [[nodiscard]] std::vector<GoneBlock> gone() const {
    std::vector<GoneBlock> result;
    for (const auto& [key, marks] : blocks_) {
      GoneBlock block{key.first, key.second, {}};
      for (std::size_t z = 0; z < kBlock; ++z) block.cells[z] = marks.first[z] & ~marks.second[z];
      if (block.cells != GoneBlock{}.cells && result.size() < kMaxGoneBlocks)
        result.push_back(block);
    }
    return result;
  }

 private:
  using Words = std::array<std::uint64_t, kBlock>;
  std::map<std::pair<RobotId, std::array<std::int32_t, 3>>, std::pair<Words, Words>> blocks_;
};

}  // namespace

const char* fault_of(const GoneSurface& gone) {
  if (!(gone.cell_m >= 1e-3F && gone.cell_m <= 100.0F)) return "cells of no size";
  if (gone.blocks.size() > kMaxGoneBlocks) return "too many blocks";
  const auto descends = [](const GoneBlock& a, const GoneBlock& b) { return order(a) >= order(b); };
  if (std::ranges::adjacent_find(gone.blocks, descends) != gone.blocks.end())
    return "blocks do not ascend";
  return nullptr;
}

bool is_gone(const GoneSurface& gone, RobotId owner, const Eigen::Vector3f& point) {
  if (gone.blocks.empty() || !has_cell(point, gone.cell_m)) return false;
  const GonePlace place = place_of(point, gone.cell_m);
  const GoneBlock wanted{owner, place.block, {}};
  const auto found = std::ranges::lower_bound(
      gone.blocks, wanted, [](const auto& a, const auto& b) { return order(a) < order(b); });
  return found != gone.blocks.end() && order(*found) == order(wanted) &&
         (found->cells[place.z] >> place.bit & 1U) != 0;
}

void SurfaceArrivals::take(const MeshChunk& chunk) {
  if (chunk.empty()) {
    chunks_.erase(chunk.key);
    return;
  }
  Chunk& known = chunks_[chunk.key];
  std::map<Place, KeyframeIndex> before;
  if (known.boot == chunk.boot)
    for (std::size_t v = 0; v < known.places.size(); ++v)
      before.emplace(known.places[v], known.arrived[v]);
  known = {.boot = chunk.boot, .places = {}, .arrived = {}};
  for (const MeshChunk::Triple& offset : chunk.offsets) {
    Place place = {};
    for (std::size_t axis = 0; axis < 3; ++axis)
      place[axis] = std::int64_t{chunk.origin[axis]} + offset[axis];
    const auto same = before.find(place);
    known.places.push_back(place);
    known.arrived.push_back(same == before.end() ? kPending : same->second);
  }
}

void SurfaceArrivals::set_newest_view(KeyframeIndex keyframe) {
  for (auto& [key, chunk] : chunks_) std::ranges::replace(chunk.arrived, kPending, keyframe);
}

std::span<const KeyframeIndex> SurfaceArrivals::of(const MeshChunkKey& key) const {
  const auto found = chunks_.find(key);
  return found == chunks_.end() ? std::span<const KeyframeIndex>() : found->second.arrived;
}

GoneSurface find_gone(const OwnViews& own, std::span<const TestedChunk> chunks, int least_views,
                      double cell_m) {
  GoneSurface result{.anchor = own.anchor, .cell_m = static_cast<float>(cell_m)};
  std::vector<SightPoint> points;
  std::vector<RobotId> owners;
  std::vector<std::pair<RobotId, Eigen::Vector3f>> recent;  // without a later view
  const KeyframeIndex newest = own.views.empty() ? 0 : own.views.back()->keyframe;
  for (const TestedChunk& chunk : chunks) {
    if (chunk.placed->anchor != own.anchor || chunk.arrived.size() != chunk.placed->vertices.size())
      continue;
    for (std::size_t v = 0; v < chunk.placed->vertices.size(); ++v) {
      if (!has_cell(chunk.placed->vertices[v], result.cell_m)) continue;
      const RobotId owner = chunk.placed->chunk->key.robot;
      if (chunk.arrived[v] >= newest) {
        recent.emplace_back(owner, chunk.placed->vertices[v]);
        continue;
      }
      points.push_back({chunk.placed->vertices[v], chunk.arrived[v], 0});
      owners.push_back(owner);
    }
  }
  SightVotes votes(points, cell_m);
  const std::size_t known = std::min(own.covariances.size(), own.T_world_odom.size());
  for (const auto& view : own.views) {
    if (view->keyframe >= known) break;
    const Matrix6& Sigma = own.covariances[view->keyframe];
    const auto sigma = [](double variance) {
      return static_cast<float>(std::numbers::sqrt2 * std::sqrt(std::max(variance, 0.0)));
    };
    const PoseSigma relative{sigma(Sigma.bottomRightCorner<3, 3>().trace()),
                             sigma(Sigma.topLeftCorner<3, 3>().trace())};
    votes.add(*view, own.T_world_odom[view->keyframe] * view->T_odom_cam, view->keyframe,
              {&relative, 1});
  }
  const std::vector<bool> seen_through = votes.seen_through(least_views);
  if (std::ranges::find(seen_through, true) == seen_through.end()) return result;
  CellMarks marks;
  for (std::size_t i = 0; i < points.size(); ++i)
    marks.mark(owners[i], place_of(points[i].position, result.cell_m), seen_through[i]);
  for (const auto& [owner, position] : recent)
    marks.mark(owner, place_of(position, result.cell_m), false);
  result.blocks = marks.gone();
  return result;
}

}  // namespace km
