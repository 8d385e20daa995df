#include "modules/mesh_deformation/superseded_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "modules/mesh/grid_cell.hpp"

namespace km {
namespace {

// Cosine of 60 degrees. Surfaces whose normals differ by more are different surfaces.
constexpr float kMinCosine = 0.5F;

// Largest distance beside a triangle at which a vertex still counts as on it, as a share of
// SameSurface::distance_m. It exceeds zero because vertices in the wedge between the normals of two
// faces that meet at an angle are beside both faces.
constexpr float kMaxBesideShare = 0.25F;

float squared_distance_to_segment(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                  const Eigen::Vector3f& b) {
  const Eigen::Vector3f ab = b - a;
  const float length2 = ab.squaredNorm();
  const float t = length2 > 0.0F ? std::clamp((p - a).dot(ab) / length2, 0.0F, 1.0F) : 0.0F;
  return (p - a - t * ab).squaredNorm();
}

// Squared distance of a point of the triangle's plane from the triangle.
float squared_distance_in_plane(const Eigen::Vector3f& p, const std::array<Eigen::Vector3f, 3>& t,
                                const Eigen::Vector3f& normal) {
  bool inside = true;
  float nearest2 = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3f &a = t[i], &b = t[(i + 1) % 3];
    if ((b - a).cross(p - a).dot(normal) >= 0.0F) continue;
    inside = false;
    nearest2 = std::min(nearest2, squared_distance_to_segment(p, a, b));
  }
  return inside ? 0.0F : nearest2;
}

// Number of averages of each vertex with its neighbours: a Gaussian of some six edges.
constexpr int kSmoothingSteps = 32;

// The certainty of the surface around each vertex. Neighbours differ by chance, and a comparison
// vertex by vertex would leave a patchwork of copies.
std::vector<std::uint32_t> certainty_around(const LabelledMesh& mesh,
                                            std::span<const std::uint8_t> certainty) {
  if (certainty.empty()) return std::vector<std::uint32_t>(mesh.vertices.size(), 0);
  std::vector<float> smooth(certainty.begin(), certainty.end()), sum, count;
  for (int step = 0; step < kSmoothingSteps; ++step) {
    sum = smooth;
    count.assign(smooth.size(), 1.0F);
    for (const auto& [a, b, c] : mesh.faces) {
      const float all = smooth[a] + smooth[b] + smooth[c];
      for (const std::uint32_t v : {a, b, c}) {
        sum[v] += all - smooth[v];
        count[v] += 2.0F;
      }
    }
    for (std::size_t v = 0; v < smooth.size(); ++v) smooth[v] = sum[v] / count[v];
  }
  std::vector<std::uint32_t> rounded;
  rounded.reserve(smooth.size());
  for (const float value : smooth) rounded.push_back(static_cast<std::uint32_t>(value + 0.5F));
  return rounded;
}

// Faces of the smallest scrap that stays. Two faces have an area of distance_m^2, so that a hole
// that a scrap leaves is smaller than four of these areas.
constexpr std::size_t kScrapFaces = 8;

// Components of the vertices without replacement, connected by the faces that stay.
class Scraps {
 public:
  explicit Scraps(std::size_t vertices) : parent_(vertices) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t find(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::uint32_t> parent_;
};

// Noise leaves scraps of a copy that no face of the better copy covers. A scrap of few faces is
// replaced like the surface around it, unless it replaces surface itself.
void replace_scraps(const LabelledMesh& mesh, std::vector<std::uint32_t>& replacements) {
  Scraps scraps(mesh.vertices.size());
  std::vector<std::size_t> faces(mesh.vertices.size(), 0);
  std::vector<std::uint32_t> beside(mesh.vertices.size(), kNoIndex);
  const auto stays = [&](std::uint32_t v) { return replacements[v] == kNoIndex; };
  const auto for_scrap_of = [&](const LabelledMesh::Face& face, const auto& visit) {
    if (const auto v = std::ranges::find_if(face, stays); v != face.end()) visit(*v);
  };
  for (const LabelledMesh::Face& face : mesh.faces)
    for_scrap_of(face, [&](std::uint32_t first) {
      for (const std::uint32_t v : face)
        if (stays(v)) scraps.join(first, v);
    });
  for (const LabelledMesh::Face& face : mesh.faces)
    for_scrap_of(face, [&](std::uint32_t first) {
      const std::uint32_t scrap = scraps.find(first);
      ++faces[scrap];
      for (const std::uint32_t v : face)
        if (!stays(v)) beside[scrap] = replacements[v];
    });
  for (const std::uint32_t replacement : replacements)
    if (replacement != kNoIndex) faces[scraps.find(replacement)] = kScrapFaces;
  const std::vector<std::uint32_t> before = replacements;
  for (std::uint32_t v = 0; v < before.size(); ++v)
    if (const std::uint32_t scrap = scraps.find(v);
        before[v] == kNoIndex && faces[scrap] < kScrapFaces)
      replacements[v] = beside[scrap];
}

// Faces that show the surface of one vertex.
class Copies {
 public:
  explicit Copies(KeyframeIndex window) : window_(window) {}

  void add(std::uint32_t face, const SeenBy& seen_by, float distance) {
    if (distance == std::numeric_limits<float>::infinity()) return;
    if (std::ranges::all_of(
            visits_, [&](const SeenBy& visit) { return keyframe_gap(visit, seen_by) > window_; }))
      visits_.push_back(seen_by);
    if (distance < nearest_) {
      nearest_ = distance;
      nearest_face_ = face;
    }
  }
  [[nodiscard]] std::size_t visits() const { return visits_.size(); }
  [[nodiscard]] std::uint32_t nearest_face() const { return nearest_face_; }

 private:
  KeyframeIndex window_;
  std::vector<SeenBy> visits_;
  float nearest_ = std::numeric_limits<float>::infinity();
  std::uint32_t nearest_face_ = kNoIndex;
};

class ReplacementSearch {
 public:
  ReplacementSearch(const LabelledMesh& mesh, const SurfaceViews& views, const SameSurface& same)
      : mesh_(mesh),
        seen_by_(views.seen_by),
        window_(same.max_gap_keyframes),
        copies_(same.copies),
        distance_(static_cast<float>(same.distance_m)),
        // Bound on the distance of a vertex from the centroid of a relevant face. No corner is
        // further from the centroid than two thirds of a median, which is shorter than the longest
        // edge.
        reach_(std::hypot(distance_, kMaxBesideShare * distance_ +
                                         static_cast<float>(same.longest_edge_m) * 2.0F / 3.0F)),
        normals_(mesh.normals()),
        certainty_(certainty_around(mesh, views.certainty)),
        replacements_(mesh.vertices.size(), kNoIndex),
        is_judged_(mesh.vertices.size(), 0) {
    for (const LabelledMesh::Face& face : mesh.faces) add_rank(face);
    for (std::size_t face = 0; face < mesh.faces.size(); ++face)
      face_normals_.push_back(mesh.face_normal(face).normalized());  // zero stays zero
  }

  std::vector<std::uint32_t> run() {
    std::vector<std::uint32_t> order(mesh_.faces.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(),
                     [this](auto a, auto b) { return rank_[a] > rank_[b]; });
    // All faces that can supersede a corner of this face have a higher rank than this face, so they
    // have been judged before.
    for (const std::uint32_t f : order) {
      const LabelledMesh::Face& face = mesh_.faces[f];
      for (const std::uint32_t v : face)
        if (std::exchange(is_judged_[v], 1) == 0) replacements_[v] = replacement_of(v);
      if (!is_superseded(face, replacements_)) insert(f);
    }
    replace_scraps(mesh_, replacements_);
    return std::move(replacements_);
  }

 private:
  struct PlacedFace {
    Eigen::Vector3f centroid;
    std::uint32_t face;
  };

  // By certainty, then by time. The rank of a face is at most that of each of its corners.
  static std::uint64_t rank(std::uint32_t certainty, KeyframeIndex keyframe) {
    return std::uint64_t{certainty} << 32U | keyframe;
  }
  void add_rank(const LabelledMesh::Face& face) {
    SeenBy seen = seen_by_[face[0]];
    std::uint32_t certainty = certainty_[face[0]];
    for (const std::uint32_t v : {face[1], face[2]}) {
      seen = {std::min(seen[0], seen_by_[v][0]), std::max(seen[1], seen_by_[v][1])};
      certainty = std::min(certainty, certainty_[v]);
    }
    face_seen_by_.push_back(seen);
    rank_.push_back(rank(certainty, seen[0]));
  }

  [[nodiscard]] GridCell cell_of(const Eigen::Vector3f& point) const {
    return grid_cell(point.cast<double>(), static_cast<double>(2.0F * reach_));
  }

  void insert(std::uint32_t face) {
    const auto& [a, b, c] = mesh_.faces[face];
    const Eigen::Vector3f centroid =
        (mesh_.vertices[a] + mesh_.vertices[b] + mesh_.vertices[c]) / 3.0F;
    cells_[cell_of(centroid)].push_back({centroid, face});
  }

  [[nodiscard]] std::uint32_t replacement_of(std::uint32_t v) const {
    const Eigen::Vector3f reach = Eigen::Vector3f::Constant(reach_);
    const GridCell low = cell_of(mesh_.vertices[v] - reach);
    const GridCell high = cell_of(mesh_.vertices[v] + reach);
    Copies copies(window_);
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t z = low[2]; z <= high[2]; ++z)
          if (const auto cell = cells_.find({x, y, z}); cell != cells_.end())
            add_copies(cell->second, v, copies);
    return copies.visits() < copies_ ? kNoIndex : nearest_corner(copies.nearest_face(), v);
  }

  // Adds the faces of a cell that show the surface of this vertex and have a higher rank.
  void add_copies(const std::vector<PlacedFace>& faces, std::uint32_t v, Copies& copies) const {
    const std::uint64_t own_rank = rank(certainty_[v], seen_by_[v][1]);
    for (const auto& [centroid, face] : faces) {
      if (rank_[face] <= own_rank) break;  // and so have all following faces
      if ((centroid - mesh_.vertices[v]).squaredNorm() > reach_ * reach_) continue;
      if (keyframe_gap(face_seen_by_[face], seen_by_[v]) <= window_) continue;
      copies.add(face, face_seen_by_[face], distance_to(face, v));
    }
  }

  // Distance along the normal of the face. Infinite if it exceeds distance_, if the normals differ
  // by more than 60 degrees, or if the vertex is beside the triangle.
  [[nodiscard]] float distance_to(std::uint32_t face, std::uint32_t v) const {
    constexpr float kNot = std::numeric_limits<float>::infinity();
    const Eigen::Vector3f& normal = face_normals_[face];
    const auto& [a, b, c] = mesh_.faces[face];
    const Eigen::Vector3f& p = mesh_.vertices[v];
    const float along = (p - mesh_.vertices[a]).dot(normal);
    if (std::abs(along) > distance_ || normals_[v].dot(normal) < kMinCosine) return kNot;
    const float beside2 = squared_distance_in_plane(
        p - along * normal, {mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]}, normal);
    const float most = kMaxBesideShare * distance_;
    return beside2 <= most * most ? std::abs(along) : kNot;
  }

  [[nodiscard]] std::uint32_t nearest_corner(std::uint32_t face, std::uint32_t v) const {
    const Eigen::Vector3f& p = mesh_.vertices[v];
    return *std::min_element(
        mesh_.faces[face].begin(), mesh_.faces[face].end(), [&](auto a, auto b) {
          return (mesh_.vertices[a] - p).squaredNorm() < (mesh_.vertices[b] - p).squaredNorm();
        });
  }

  const LabelledMesh& mesh_;
  std::span<const SeenBy> seen_by_;
  KeyframeIndex window_;
  std::size_t copies_;
  float distance_;
  float reach_;
  std::vector<Eigen::Vector3f> normals_, face_normals_;
  std::vector<SeenBy> face_seen_by_;
  std::vector<std::uint32_t> certainty_;  // certainty_around() each vertex
  std::vector<std::uint64_t> rank_;       // rank of each face
  std::vector<std::uint32_t> replacements_;
  std::vector<char> is_judged_;
  // Faces that stay, by descending rank, in the cells of their centroids.
  std::unordered_map<GridCell, std::vector<PlacedFace>, GridCellHash> cells_;
};

}  // namespace

std::vector<std::uint32_t> find_replacements(const LabelledMesh& mesh, const SurfaceViews& views,
                                             const SameSurface& same) {
  return ReplacementSearch(mesh, views, same).run();
}

std::vector<std::uint32_t> remaining_vertices(const LabelledMesh& mesh,
                                              std::span<const std::uint32_t> replacements) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& face : mesh.faces)
    if (!is_superseded(face, replacements))
      for (const std::uint32_t v : face) used[v] = true;
  std::vector<std::uint32_t> kept;
  for (std::uint32_t v = 0; v < used.size(); ++v)
    if (used[v] || replacements[v] == kNoIndex) kept.push_back(v);
  return kept;
}

LabelledMesh without_superseded(const LabelledMesh& mesh,
                                std::span<const std::uint32_t> replacements) {
  LabelledMesh result = mesh;
  std::erase_if(result.faces, [&](const auto& face) { return is_superseded(face, replacements); });
  result.keep_vertices(remaining_vertices(mesh, replacements));
  return result;
}

SupersededSurface named(std::span<const std::uint32_t> replacements,
                        std::span<const std::uint64_t> ids) {
  SupersededSurface surface;
  for (std::size_t v = 0; v < replacements.size(); ++v)
    if (replacements[v] != kNoIndex) surface.vertices.push_back({ids[v], ids[replacements[v]]});
  return surface;
}

}  // namespace km
