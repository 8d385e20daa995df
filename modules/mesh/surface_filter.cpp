#include "modules/mesh/surface_filter.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace km {
namespace {

// Faces whose normals differ by more than 66 degrees do not smooth each other.
constexpr float kLeastCosine = 0.4F;

using Face = LabelledMesh::Face;
using Vectors = std::vector<Eigen::Vector3f>;

// The faces at each vertex.
class FacesAround {
 public:
  FacesAround(std::size_t vertices, std::span<const Face> faces) : first_(vertices + 1, 0) {
    for (const Face& face : faces)
      for (const std::uint32_t v : face) ++first_[v + 1];
    for (std::size_t v = 0; v < vertices; ++v) first_[v + 1] += first_[v];
    faces_.resize(3 * faces.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t f = 0; f < faces.size(); ++f)
      for (const std::uint32_t v : faces[f]) faces_[next[v]++] = static_cast<std::uint32_t>(f);
  }
  [[nodiscard]] std::span<const std::uint32_t> operator[](std::size_t vertex) const {
    return std::span(faces_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }

 private:
  std::vector<std::uint32_t> first_, faces_;
};

// Unit normals, with the areas as fourth elements.
std::vector<Eigen::Vector4f> normals_of(const Vectors& vertices, std::span<const Face> faces) {
  std::vector<Eigen::Vector4f> normals;
  normals.reserve(faces.size());
  for (const auto& [a, b, c] : faces) {
    const Eigen::Vector3f across = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
    const float length = std::max(across.norm(), 1e-12F);
    normals.emplace_back(across.x() / length, across.y() / length, across.z() / length, length);
  }
  return normals;
}

// The other faces that share a corner with each face, each once.
class Neighbours {
 public:
  Neighbours(std::span<const Face> faces, const FacesAround& around) : first_(1, 0) {
    first_.reserve(faces.size() + 1);
    faces_.reserve(13 * faces.size());
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      const auto& [a, b, c] = faces[f];
      const auto has = [&](std::uint32_t other, std::uint32_t v) {
        return faces[other][0] == v || faces[other][1] == v || faces[other][2] == v;
      };
      for (const std::uint32_t other : around[a])
        if (other != f) faces_.push_back(other);
      for (const std::uint32_t other : around[b])
        if (other != f && !has(other, a)) faces_.push_back(other);
      for (const std::uint32_t other : around[c])
        if (other != f && !has(other, a) && !has(other, b)) faces_.push_back(other);
      first_.push_back(static_cast<std::uint32_t>(faces_.size()));
    }
  }
  [[nodiscard]] std::span<const std::uint32_t> operator[](std::size_t face) const {
    return std::span(faces_).subspan(first_[face], first_[face + 1] - first_[face]);
  }

 private:
  std::vector<std::uint32_t> first_, faces_;
};

void filter_normals(const Neighbours& neighbours, std::vector<Eigen::Vector4f>& normals,
                    std::vector<Eigen::Vector4f>& filtered) {
  for (std::size_t f = 0; f < normals.size(); ++f) {
    Eigen::Vector4f own = normals[f];
    const float area = std::exchange(own.w(), 0.0F);
    Eigen::Vector4f sum = 1e-9F * own;
    for (const std::uint32_t other : neighbours[f]) {
      const Eigen::Vector4f& normal = normals[other];
      const float share = std::max(own.dot(normal) - kLeastCosine, 0.0F);
      sum += share * share * normal.w() * normal;
    }
    sum.w() = 0.0F;
    filtered[f] = sum / sum.norm();
    filtered[f].w() = area;
  }
  normals.swap(filtered);
}

// Moves the vertices so that faces are perpendicular to their filtered normals.
void move_vertices(std::span<const Face> faces, const FacesAround& around,
                   const std::vector<Eigen::Vector4f>& normals, Vectors& moves, Vectors& vertices) {
  std::ranges::fill(moves, Eigen::Vector3f::Zero());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const Eigen::Vector3f normal = normals[f].head<3>();
    const auto& [a, b, c] = faces[f];
    const float height_a = normal.dot(vertices[a]), height_b = normal.dot(vertices[b]),
                height_c = normal.dot(vertices[c]);
    const float middle = (height_a + height_b + height_c) / 3.0F;
    moves[a] += (middle - height_a) * normal;
    moves[b] += (middle - height_b) * normal;
    moves[c] += (middle - height_c) * normal;
  }
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (!around[v].empty()) vertices[v] += moves[v] / static_cast<float>(around[v].size());
}

// Adds the vertices within kFilterRings rings around those of `region`.
void grow(std::span<const Face> faces, const FacesAround& around, std::vector<bool>& is_in,
          std::vector<std::uint32_t>& region) {
  std::size_t begin = 0;
  for (int ring = 0; ring < kFilterRings; ++ring) {
    const std::size_t end = region.size();
    for (; begin < end; ++begin)
      for (const std::uint32_t f : around[region[begin]])
        for (const std::uint32_t v : faces[f]) {
          if (is_in[v]) continue;
          is_in[v] = true;
          region.push_back(v);
        }
  }
}

}  // namespace

Vectors filter_surface(const Vectors& vertices, std::span<const Face> faces) {
  const FacesAround around(vertices.size(), faces);
  const Neighbours neighbours(faces, around);
  std::vector<Eigen::Vector4f> normals = normals_of(vertices, faces), filtered(faces.size());
  for (int round = 0; round < kNormalRounds; ++round) filter_normals(neighbours, normals, filtered);
  Vectors result = vertices, moves(vertices.size());
  for (int round = 0; round < kVertexRounds; ++round)
    move_vertices(faces, around, normals, moves, result);
  return result;
}

void filter_surface(const Vectors& vertices, std::span<const Face> faces,
                    const std::vector<std::uint32_t>& changed, Vectors& filtered) {
  const FacesAround around(vertices.size(), faces);
  std::vector<bool> is_in(vertices.size(), false);
  for (const std::uint32_t v : changed) is_in[v] = true;
  std::vector<std::uint32_t> region = changed;
  grow(faces, around, is_in, region);
  const std::size_t wanted = region.size();  // the rest of the region is their surroundings
  grow(faces, around, is_in, region);
  std::vector<std::uint32_t> place(vertices.size());
  Vectors part;
  for (const std::uint32_t v : region) {
    place[v] = static_cast<std::uint32_t>(part.size());
    part.push_back(vertices[v]);
  }
  std::vector<Face> part_faces;
  for (const auto& [a, b, c] : faces)
    if (is_in[a] && is_in[b] && is_in[c]) part_faces.push_back({place[a], place[b], place[c]});
  part = filter_surface(part, part_faces);
  for (std::size_t i = 0; i < wanted; ++i) filtered[region[i]] = part[i];
}

}  // namespace km
