#include "modules/mesh/mesh_chunks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

using GridPoint = MeshCells::Cell;  // [steps] or [cells]
using Face = LabelledMesh::Face;

constexpr double kFarthest_steps = 1U << 30U;  // so that the sum of three fits into 64 bits
constexpr std::int64_t kMaxOffset = std::numeric_limits<std::uint16_t>::max();
constexpr std::int64_t kThirdOfMaxOffset = kMaxOffset / 3;
constexpr float kMaxVoxel_m = 64.0F;
constexpr double kFarthest_m = 1e7;  // bound on a robot's distance from the origin of a frame

std::vector<GridPoint> quantise(const std::vector<Eigen::Vector3f>& vertices, double step_m) {
  std::vector<GridPoint> points;
  points.reserve(vertices.size());
  for (const Eigen::Vector3f& vertex : vertices) {
    GridPoint point = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double steps =
          std::round(static_cast<double>(vertex[static_cast<Eigen::Index>(axis)]) / step_m);
      if (!(std::abs(steps) <= kFarthest_steps))
        throw std::invalid_argument("mesh chunks: vertex " + std::to_string(points.size()) +
                                    " is not finite or too far away");
      point[axis] = static_cast<std::int32_t>(steps);
    }
    points.push_back(point);
  }
  return points;
}

std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a >= 0 ? a / b : -((b - 1 - a) / b);
}

// Extent of the vertices of a chunk.
class OffsetRange {
 public:
  void extend(const GridPoint& point) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low_[axis] = std::min(low_[axis], point[axis]);
      high_[axis] = std::max(high_[axis], point[axis]);
    }
  }
  [[nodiscard]] bool fits() const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (std::int64_t{high_[axis]} - low_[axis] > kMaxOffset) return false;
    return true;
  }

 private:
  static constexpr std::int32_t kLowest = std::numeric_limits<std::int32_t>::min();
  static constexpr std::int32_t kHighest = std::numeric_limits<std::int32_t>::max();
  GridPoint low_ = {kHighest, kHighest, kHighest}, high_ = {kLowest, kLowest, kLowest};
};

// States the views of the vertices of chunks; does nothing without an origin.
class ChunkViews {
 public:
  explicit ChunkViews(const MeshOrigin* origin) : origin_(origin) {
    if (origin == nullptr) return;
    keyframes_ = mesh_keyframes(origin->T_world_kf);
    step_ = mesh_keyframe_step(origin->T_world_kf.size());
  }

  // Bytes that state() adds at most to a chunk with this number of vertices.
  [[nodiscard]] std::size_t largest_bytes(std::size_t vertices) const {
    return origin_ == nullptr ? 0 : kMaxChunkKeyframes * kMeshKeyframeBytes + 2 * vertices;
  }

  void state(std::span<const std::uint32_t> vertices, MeshChunk& chunk) const {
    if (origin_ == nullptr) return;
    std::size_t spread = 1;  // every spread-th of keyframes_
    std::vector<std::size_t> used = used_keyframes(vertices, spread);
    while (used.size() > kMaxChunkKeyframes) used = used_keyframes(vertices, spread *= 2);
    for (const std::size_t k : used) chunk.keyframes.push_back(keyframes_[k * spread]);
    for (const std::uint32_t v : vertices) {
      std::array<MeshChunk::View, 2> views = {};
      for (std::size_t i = 0; i < 2; ++i) {
        const Time time = time_of(origin_->seen_by[v][i], spread);
        const auto slot = std::ranges::lower_bound(used, time.keyframe) - used.begin();
        views[i] = static_cast<MeshChunk::View>(kViewsPerKeyframe * static_cast<std::size_t>(slot) +
                                                time.share);
      }
      chunk.views.push_back(views);
    }
  }

 private:
  // After keyframes_[spread * keyframe] by this share of the way to the next one.
  struct Time {
    std::size_t keyframe = 0;
    std::size_t share = 0;
  };
  // Beyond the last keyframe of keyframes_, that one.
  [[nodiscard]] Time time_of(KeyframeIndex index, std::size_t spread) const {
    const std::size_t length = step_ * spread, keyframe = index / length;
    const bool is_last = (keyframe + 1) * spread >= keyframes_.size();
    return {keyframe, is_last ? 0 : index % length * kViewsPerKeyframe / length};
  }

  // Keyframes that the views of these vertices need, ascending.
  [[nodiscard]] std::vector<std::size_t> used_keyframes(std::span<const std::uint32_t> vertices,
                                                        std::size_t spread) const {
    std::set<std::size_t> used;
    for (const std::uint32_t v : vertices)
      for (const KeyframeIndex index : origin_->seen_by[v]) {
        const Time time = time_of(index, spread);
        used.insert(time.keyframe);
        if (time.share > 0) used.insert(time.keyframe + 1);
      }
    return {used.begin(), used.end()};
  }

  const MeshOrigin* origin_;
  std::vector<MeshKeyframe> keyframes_;
  std::size_t step_ = 1;
};

// Splits one mesh into chunks.
class Splitter {
 public:
  Splitter(const LabelledMesh& mesh, const MeshChunk& blank, const ChunkGrid& grid,
           const MeshOrigin* origin)
      : mesh_(mesh),
        blank_(blank),
        levels_(origin == nullptr ? std::span<const std::uint8_t>() : origin->levels),
        views_(origin),
        cell_steps_(static_cast<std::int64_t>(std::round(grid.cell_m / grid.step_m))),
        points_(quantise(mesh.vertices, static_cast<double>(blank.step_m))),
        mapped_(origin == nullptr ? std::vector<GridPoint>()
                                  : quantise(origin->mapped, static_cast<double>(blank.step_m))),
        part_of_vertex_(mesh.vertices.size(), 0),
        local_index_(mesh.vertices.size(), 0) {}

  SplitMesh split() {
    sort_into_cells();
    for (auto& [cell, faces] : faces_of_cell_) {
      std::ranges::sort(faces, {},
                        [this](const Face& face) { return std::pair(level(face), face); });
      add_cell(cell, faces);
    }
    return std::move(pieces_);
  }

 private:
  [[nodiscard]] int level(const Face& face) const { return levels_.empty() ? 0 : levels_[face[0]]; }

  [[nodiscard]] bool fits_offsets(const Face& face) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [low, high] =
          std::minmax({points_[face[0]][axis], points_[face[1]][axis], points_[face[2]][axis]});
      // A third of the range, so that two such faces of one cell of at most that size fit together.
      if (std::int64_t{high} - low > kThirdOfMaxOffset) return false;
    }
    return true;
  }

  [[nodiscard]] GridPoint cell_of(const Face& face) const {
    const std::vector<GridPoint>& points = mapped_.empty() ? points_ : mapped_;
    GridPoint cell = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::int64_t sum = 0;
      for (const std::uint32_t corner : face) sum += points[corner][axis];
      cell[axis] = static_cast<std::int32_t>(floor_div(sum, 3 * cell_steps_));
    }
    return cell;
  }

  void sort_into_cells() {
    GridPoint last_cell = {};
    std::vector<Face>* last = nullptr;  // neighbours in the list are usually neighbours in space
    for (Face face : mesh_.faces) {
      if (!fits_offsets(face)) {
        ++pieces_.oversized_faces;
        continue;
      }
      const GridPoint cell = cell_of(face);
      if (last == nullptr || cell != last_cell) {
        last = &faces_of_cell_[cell];
        last_cell = cell;
      }
      std::rotate(face.begin(), std::ranges::min_element(face),
                  face.end());  // lowest first, same orientation
      last->push_back(face);
    }
  }

  void add_cell(const GridPoint& cell, const std::vector<Face>& faces) {
    std::uint16_t part = 0;
    for (std::size_t begin = 0; begin < faces.size();) {
      std::vector<std::uint32_t> vertices;
      const std::size_t end = take_faces(faces, begin, vertices);
      add_chunk({blank_.key.robot, cell, part++}, std::span(faces).subspan(begin, end - begin),
                std::move(vertices));
      begin = end;
    }
  }

  // Collects the vertices of as many faces as fit into one chunk; returns the end of these faces.
  std::size_t take_faces(const std::vector<Face>& faces, std::size_t begin,
                         std::vector<std::uint32_t>& vertices) {
    ++part_;
    OffsetRange range;
    std::size_t end = begin;
    for (; end < faces.size(); ++end) {
      std::size_t fresh = 0;
      for (const std::uint32_t v : faces[end]) fresh += part_of_vertex_[v] != part_ ? 1 : 0;
      if (plain_bytes(vertices.size() + fresh, end + 1 - begin, !mesh_.labels.empty(),
                      !mesh_.colors.empty()) +
              views_.largest_bytes(vertices.size() + fresh) >
          kMaxChunkBytes)
        break;
      if (level(faces[end]) != level(faces[begin])) break;
      // Surfaces of two visits may be in one cell before the deformation, and apart after it.
      for (const std::uint32_t v : faces[end]) range.extend(points_[v]);
      if (!range.fits()) break;
      for (const std::uint32_t v : faces[end])
        if (std::exchange(part_of_vertex_[v], part_) != part_) vertices.push_back(v);
    }
    return end;
  }

  void add_chunk(const MeshChunkKey& key, std::span<const Face> faces,
                 std::vector<std::uint32_t> vertices) {
    std::ranges::sort(vertices);
    MeshChunk chunk = blank_;
    chunk.key = key;
    chunk.voxel_m = std::min(std::ldexp(chunk.voxel_m, level(faces.front())), kMaxVoxel_m);
    chunk.origin = points_[vertices.front()];
    for (const std::uint32_t v : vertices)
      for (std::size_t axis = 0; axis < 3; ++axis)
        chunk.origin[axis] = std::min(chunk.origin[axis], points_[v][axis]);
    for (const std::uint32_t v : vertices) {
      local_index_[v] = static_cast<std::uint16_t>(chunk.offsets.size());
      MeshChunk::Triple offset = {};
      for (std::size_t axis = 0; axis < 3; ++axis)
        offset[axis] = static_cast<std::uint16_t>(points_[v][axis] - chunk.origin[axis]);
      chunk.offsets.push_back(offset);
      if (!mesh_.labels.empty()) chunk.labels.push_back(mesh_.labels[v]);
      if (!mesh_.colors.empty()) chunk.colors.push_back(packed_color(mesh_.colors[v]));
    }
    for (const auto& [a, b, c] : faces)
      chunk.faces.push_back({local_index_[a], local_index_[b], local_index_[c]});
    views_.state(vertices, chunk);
    pieces_.chunks.push_back(std::move(chunk));
  }

  const LabelledMesh& mesh_;
  const MeshChunk& blank_;
  std::span<const std::uint8_t> levels_;
  const ChunkViews views_;
  std::int64_t cell_steps_;
  std::vector<GridPoint> points_;
  std::vector<GridPoint> mapped_;  // before the deformation; empty: unknown
  std::map<GridPoint, std::vector<Face>> faces_of_cell_;
  std::vector<std::uint32_t> part_of_vertex_;  // the last part that contains the vertex
  std::uint32_t part_ = 0;
  std::vector<std::uint16_t> local_index_;  // index in that part
  SplitMesh pieces_;
};

void check(const MeshOrigin& origin, const LabelledMesh& mesh) {
  const std::size_t vertices = mesh.vertices.size();
  if (origin.seen_by.size() != vertices || origin.mapped.size() != vertices ||
      !(origin.levels.empty() || origin.levels.size() == vertices))
    throw std::invalid_argument("mesh chunks: an origin of " +
                                std::to_string(origin.seen_by.size()) + " vertices for " +
                                std::to_string(vertices));
  for (const auto& [first, last] : origin.seen_by)
    if (std::max(first, last) >= origin.T_world_kf.size())
      throw std::invalid_argument("mesh chunks: a vertex was seen by keyframe " +
                                  std::to_string(std::max(first, last)) + " of " +
                                  std::to_string(origin.T_world_kf.size()));
}

void check(const LabelledMesh& mesh, const ChunkGrid& grid) {
  // Faces extend up to a third of the range of offsets beyond their cell on both sides.
  if (!(grid.step_m > 0.0) || !(grid.cell_m > grid.step_m) ||
      !(grid.cell_m / grid.step_m <= static_cast<double>(kThirdOfMaxOffset)))
    throw std::invalid_argument("mesh chunks: cells of " + std::to_string(grid.cell_m) +
                                " m in steps of " + std::to_string(grid.step_m) + " m");
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.vertices.size())
    throw std::invalid_argument("mesh chunks: " + std::to_string(mesh.colors.size()) +
                                " colours for " + std::to_string(mesh.vertices.size()) +
                                " vertices");
  if (!mesh.labels.empty() && mesh.labels.size() != mesh.vertices.size())
    throw std::invalid_argument("mesh chunks: " + std::to_string(mesh.labels.size()) +
                                " labels for " + std::to_string(mesh.vertices.size()) +
                                " vertices");
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (const std::uint32_t corner : mesh.faces[f])
      if (corner >= mesh.vertices.size())
        throw std::invalid_argument("mesh chunks: face " + std::to_string(f) + " names vertex " +
                                    std::to_string(corner) + " of " +
                                    std::to_string(mesh.vertices.size()));
}

// True if the step of the grid is positive, and the origin lies within kFarthest_m.
bool are_positions_usable(const MeshChunk& chunk) {
  if (!(chunk.step_m > 0.0F)) return false;
  return std::ranges::all_of(chunk.origin, [&](std::int32_t c) {
    const double steps = std::abs(static_cast<double>(c));
    return steps <= kFarthest_steps &&
           (steps + kMaxOffset) * static_cast<double>(chunk.step_m) <= kFarthest_m;
  });
}

const char* fault_of_views(const MeshChunk& chunk) {
  if (chunk.keyframes.size() > kMaxChunkKeyframes) return "too many keyframes";
  if (chunk.views.size() != (chunk.keyframes.empty() ? 0 : chunk.offsets.size()))
    return "views do not fit the vertices";
  for (const auto& views : chunk.views)
    for (const MeshChunk::View view : views)
      if ((view + kViewsPerKeyframe - 1) / kViewsPerKeyframe >= chunk.keyframes.size())
        return "a view between keyframes which do not exist";
  return nullptr;
}

}  // namespace

const char* fault_of(const MeshChunk& chunk) {
  const std::size_t vertices = chunk.offsets.size();
  if (!chunk.labels.empty() && chunk.labels.size() != vertices)
    return "labels do not fit the vertices";
  if (!chunk.colors.empty() && chunk.colors.size() != vertices)
    return "colours do not fit the vertices";
  if (plain_bytes(chunk) > kMaxChunkBytes) return "a chunk that is too large";
  for (const MeshChunk::Triple& face : chunk.faces)
    if (std::ranges::max(face) >= vertices) return "a face names a vertex which does not exist";
  if (chunk.faces.empty() != chunk.offsets.empty()) return "vertices without faces";
  if (const char* fault = fault_of(chunk.keyframes)) return fault;
  if (const char* fault = fault_of_views(chunk)) return fault;
  if (!(chunk.voxel_m == 0.0F || (chunk.voxel_m >= 0.005F && chunk.voxel_m <= kMaxVoxel_m)))
    return "voxels of an unusual size";
  if (!are_positions_usable(chunk)) return "positions are not finite or too far away";
  return nullptr;
}

std::uint16_t packed_color(const LabelledMesh::Color& color) {
  const auto& [red, green, blue] = color;
  return static_cast<std::uint16_t>((red >> 3U) << 11U | (green >> 2U) << 5U | blue >> 3U);
}

LabelledMesh::Color unpacked_color(std::uint16_t packed) {
  const unsigned red = packed >> 11U, green = packed >> 5U & 63U, blue = packed & 31U;
  return {static_cast<std::uint8_t>(red << 3U | red >> 2U),
          static_cast<std::uint8_t>(green << 2U | green >> 4U),
          static_cast<std::uint8_t>(blue << 3U | blue >> 2U)};
}

SplitMesh split_mesh(const LabelledMesh& mesh, RobotId robot, RobotId anchor, const ChunkGrid& grid,
                     const MeshOrigin* origin) {
  check(mesh, grid);
  if (origin != nullptr) check(*origin, mesh);
  MeshChunk blank;
  blank.key.robot = robot;
  blank.anchor = anchor;
  blank.step_m = static_cast<float>(grid.step_m);
  if (origin != nullptr) blank.voxel_m = static_cast<float>(origin->voxel_m);
  return Splitter(mesh, blank, grid, origin).split();
}

std::vector<MeshCells::Cell> occupied_cells(const LabelledMesh& mesh, double cell_m) {
  std::set<GridPoint> cells;
  GridPoint last = {};  // neighbours in the list are usually neighbours in space
  for (const auto& [a, b, c] : mesh.faces) {
    const Eigen::Array3d centroid =
        (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]).cast<double>().array() / 3.0;
    const Eigen::Array3d cell = (centroid / cell_m).floor();
    if (!(cell.abs() < kFarthest_steps).all()) continue;
    const GridPoint now = {static_cast<std::int32_t>(cell.x()), static_cast<std::int32_t>(cell.y()),
                           static_cast<std::int32_t>(cell.z())};
    if (cells.empty() || now != last) cells.insert(now);
    last = now;
  }
  return {cells.begin(), cells.end()};
}

}  // namespace km
