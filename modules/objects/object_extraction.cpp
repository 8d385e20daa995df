#include "modules/objects/object_extraction.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

#include "modules/mesh/grid_cell.hpp"

namespace km {
namespace {

constexpr std::uint32_t kNoVertex = ~std::uint32_t{0};

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// Disjoint sets; the smallest member represents its set.
class Sets {
 public:
  explicit Sets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// The part of a mesh that has one label.
class Surface {
 public:
  Surface(const LabelledMesh& mesh, std::vector<std::uint32_t> faces,
          std::vector<std::uint32_t>& local)
      : mesh_(mesh), faces_(std::move(faces)), local_(local) {
    for (const std::uint32_t f : faces_)
      for (const std::uint32_t v : mesh_.faces[f])
        if (local_[v] == kNoVertex) {
          local_[v] = static_cast<std::uint32_t>(vertices_.size());
          vertices_.push_back(v);
        }
  }
  ~Surface() {
    for (const std::uint32_t v : vertices_) local_[v] = kNoVertex;
  }
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;

  // Lists of faces, one for each connected part.
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> parts(double gap_m) const {
    Sets sets(vertices_.size());
    for (const std::uint32_t f : faces_) {
      const auto& [a, b, c] = mesh_.faces[f];
      sets.join(local_[a], local_[b]);
      sets.join(local_[a], local_[c]);
    }
    if (gap_m > 0.0) join_near(sets, static_cast<float>(gap_m));
    std::map<std::uint32_t, std::vector<std::uint32_t>> by_set;
    for (const std::uint32_t f : faces_) by_set[sets.find(local_[mesh_.faces[f][0]])].push_back(f);
    std::vector<std::vector<std::uint32_t>> result;
    for (auto& [set, faces] : by_set) result.push_back(std::move(faces));
    return result;
  }

 private:
  void join_near(Sets& sets, float gap_m) const {
    std::unordered_map<GridCell, std::vector<std::uint32_t>, GridCellHash> cells;
    for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
      const Eigen::Vector3f& p = mesh_.vertices[vertices_[i]];
      const Eigen::Vector3i at = (p / gap_m).array().floor().cast<int>();
      for (int n = 0; n < 27; ++n) {
        const auto cell =
            cells.find({at.x() + n % 3 - 1, at.y() + n / 3 % 3 - 1, at.z() + n / 9 - 1});
        if (cell == cells.end()) continue;
        for (const std::uint32_t other : cell->second)
          if ((mesh_.vertices[vertices_[other]] - p).squaredNorm() <= gap_m * gap_m)
            sets.join(i, other);
      }
      cells[{at.x(), at.y(), at.z()}].push_back(i);
    }
  }

  const LabelledMesh& mesh_;
  const std::vector<std::uint32_t> faces_;
  std::vector<std::uint32_t>& local_;  // number of each vertex of the mesh in vertices_
  std::vector<std::uint32_t> vertices_;
};

// Number of keyframes in the union of intervals.
std::uint32_t keyframes_in(std::vector<std::array<KeyframeIndex, 2>> intervals) {
  std::ranges::sort(intervals);
  std::uint64_t count = 0, next = 0;  // next: first keyframe that is not counted yet
  for (const auto& [first, last] : intervals) {
    const std::uint64_t from = std::max<std::uint64_t>(first, next);
    if (last < from) continue;
    next = std::uint64_t{last} + 1;
    count += next - from;
  }
  return static_cast<std::uint32_t>(count);
}

MapObject object_of(const LabelledMesh& mesh, std::span<const std::array<KeyframeIndex, 2>> seen_by,
                    const std::vector<std::uint32_t>& faces, LabelId label, RobotId robot) {
  MapObject object{.label = label, .box = {}, .keyframe = {robot, 0}, .robots = {robot}};
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t f : faces) {
    object.surface_m2 += 0.5 * static_cast<double>(mesh.face_normal(f).norm());
    vertices.insert(vertices.end(), mesh.faces[f].begin(), mesh.faces[f].end());
  }
  std::ranges::sort(vertices);
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<KeyframeIndex, 2>> seen;
  std::vector<KeyframeIndex> last;
  for (const std::uint32_t v : vertices) {
    points.emplace_back(mesh.vertices[v].cast<double>());
    seen.push_back(seen_by[v]);
    last.push_back(seen_by[v][1]);
  }
  std::ranges::nth_element(last, last.begin() + static_cast<std::ptrdiff_t>(last.size() / 2));
  object.keyframe.index = last[last.size() / 2];
  object.views = keyframes_in(std::move(seen));
  object.box = enclosing_box(points);
  return object;
}

}  // namespace

ObjectLabels object_labels(const LabelPalette& palette, std::span<const std::string> background) {
  ObjectLabels labels;
  for (const LabelClass& entry : palette.classes())
    labels[entry.id] = std::ranges::none_of(background, [&](const std::string& name) {
      return lower_case(name) == lower_case(entry.name);
    });
  return labels.reset(0);
}

std::vector<MapObject> extract_objects(const LabelledMesh& mesh,
                                       std::span<const std::array<KeyframeIndex, 2>> seen_by,
                                       RobotId robot, const ObjectLabels& labels,
                                       const ObjectsConfig& config) {
  if (mesh.labels.empty()) return {};
  if (seen_by.size() != mesh.vertices.size() || mesh.labels.size() != mesh.vertices.size())
    throw std::invalid_argument("objects: " + std::to_string(mesh.vertices.size()) +
                                " vertices, but " + std::to_string(seen_by.size()) +
                                " intervals of keyframes and " +
                                std::to_string(mesh.labels.size()) + " labels");
  std::map<LabelId, std::vector<std::uint32_t>> faces;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    if (const LabelId label = mesh.face_label(f); labels[label]) faces[label].push_back(f);
  std::vector<MapObject> objects;
  std::vector<std::uint32_t> local(mesh.vertices.size(), kNoVertex);
  for (auto& [label, of_label] : faces) {
    const Surface surface(mesh, std::move(of_label), local);
    for (const auto& part : surface.parts(config.gap_m)) {
      MapObject object = object_of(mesh, seen_by, part, label, robot);
      if (object.surface_m2 >= config.min_surface_m2 &&
          object.views >= static_cast<std::uint32_t>(config.min_views))
        objects.push_back(std::move(object));
    }
  }
  return objects;
}

}  // namespace km
