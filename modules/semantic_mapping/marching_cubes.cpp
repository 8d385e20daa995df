#include "modules/semantic_mapping/marching_cubes.hpp"

namespace km {
namespace {

constexpr int kNone = -1;

// Corners of the faces, counter-clockwise seen from outside the cell.
constexpr std::array<std::array<int, 4>, 6> kFaces = {{
    {0, 4, 6, 2},
    {1, 3, 7, 5},  // x = 0, x = 1
    {0, 1, 5, 4},
    {2, 6, 7, 3},  // y
    {0, 2, 3, 1},
    {4, 5, 7, 6},  // z
}};

// The edge between two corners that differ in one bit.
int edge_between(int a, int b) {
  const int low = a & b;
  for (int edge = 0; edge < MarchingCubes::kEdges; ++edge)
    if (MarchingCubes::first_corner_of_edge(edge) == low &&
        (low | 1 << MarchingCubes::axis_of_edge(edge)) == (a | b))
      return edge;
  return kNone;
}

// For every edge that the surface cuts, the one that follows on its loop. Around a face seen from
// outside, the cut leads from where a run of negative corners begins to where it ends; the edge
// where it ends is where one begins on the other face that shares the edge.
std::array<int, MarchingCubes::kEdges> successors(unsigned negative) {
  const auto is_negative = [&](int corner) { return (negative >> corner & 1U) != 0; };
  std::array<int, MarchingCubes::kEdges> next;
  next.fill(kNone);
  for (const auto& face : kFaces)
    for (std::size_t begin = 0; begin < 4; ++begin) {
      if (is_negative(face[begin]) || !is_negative(face[(begin + 1) % 4])) continue;
      std::size_t end = begin + 1;
      while (is_negative(face[(end + 1) % 4])) ++end;
      const int from = edge_between(face[begin], face[(begin + 1) % 4]);
      const int to = edge_between(face[end % 4], face[(end + 1) % 4]);
      next[static_cast<std::size_t>(from)] = to;
    }
  return next;
}

}  // namespace

MarchingCubes::MarchingCubes() {
  for (unsigned negative = 0; negative < 256; ++negative) {
    first_[negative] = static_cast<std::uint16_t>(triangles_.size());
    auto next = successors(negative);
    for (std::size_t start = 0; start < kEdges; ++start) {
      std::vector<std::uint8_t> loop;
      for (std::size_t edge = start; next[edge] != kNone;) {
        loop.push_back(static_cast<std::uint8_t>(edge));
        const auto following = static_cast<std::size_t>(next[edge]);
        next[edge] = kNone;
        edge = following;
      }
      for (std::size_t i = 2; i < loop.size(); ++i)
        triangles_.push_back({loop[0], loop[i - 1], loop[i]});
    }
  }
  first_[256] = static_cast<std::uint16_t>(triangles_.size());
}

}  // namespace km
