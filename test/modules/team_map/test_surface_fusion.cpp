#include "modules/team_map/surface_fusion.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Triangle = RobotSurface::Triangle;

constexpr double kVoxel_m = 0.05;

// A square of 0.8 m in the middle of box 0, seen from the side of `normal`, at height `h` along it.
RobotSurface square(RobotId robot, const Eigen::Vector3f& normal, float h, LabelId label = 1) {
  const Eigen::Vector3f up = normal.cwiseAbs(), u = Eigen::Vector3f(up.y(), up.z(), up.x()),
                        v = normal.cross(u), middle = 0.8F * (u + v.cwiseAbs()) + h * up;
  const auto corner = [&](float a, float b) -> Eigen::Vector3f {
    return middle + 0.4F * a * u + 0.4F * b * v;
  };
  RobotSurface surface{.robot = robot, .triangles = {}};
  surface.triangles.push_back({{corner(-1, -1), corner(1, -1), corner(1, 1)}, label});
  surface.triangles.push_back({{corner(-1, -1), corner(1, 1), corner(-1, 1)}, label});
  return surface;
}

FusedBox fuse(const std::vector<RobotSurface>& surfaces) {
  return SurfaceFusion(kVoxel_m).fuse({0, 0, 0}, surfaces);
}

// Area of the faces whose normal is along `normal` [m^2].
double area_along(const FusedBox& box, const Eigen::Vector3f& normal) {
  double area = 0.0;
  for (const auto& [a, b, c] : box.faces)
    area += std::max(0.5F * (box.vertices[b] - box.vertices[a])
                                .cross(box.vertices[c] - box.vertices[a])
                                .dot(normal),
                     0.0F);
  return area;
}

// A square may lose or gain a voxel at each border.
void check_area(double area) {
  CHECK(area > 0.7 * 0.7 - 1e-5);
  CHECK(area < 0.9 * 0.9 + 1e-5);
}

void check_height(const FusedBox& box, const Eigen::Vector3f& normal, float h) {
  REQUIRE_FALSE(box.faces.empty());
  for (const Eigen::Vector3f& p : box.vertices) CHECK(p.dot(normal) == Approx(h).margin(1e-5));
}

const Eigen::Vector3f kUp = Eigen::Vector3f::UnitZ();

}  // namespace

TEST_CASE("Two copies of a surface become one, half way between them") {
  const FusedBox box = fuse({square(0, kUp, 0.60F), square(3, kUp, 0.65F)});
  check_height(box, kUp, 0.625F);
  check_area(area_along(box, kUp));
}

TEST_CASE("Copies beyond the band stay two surfaces") {
  const FusedBox box = fuse({square(0, kUp, 0.40F), square(1, kUp, 0.80F)});
  check_area(0.5 * area_along(box, kUp));
}

TEST_CASE("A wall that two robots see from two sides has two surfaces") {
  const FusedBox box = fuse({square(0, kUp, 0.62F), square(1, -kUp, 0.51F)});
  check_area(area_along(box, kUp));
  check_area(area_along(box, -kUp));
  for (const Eigen::Vector3f& p : box.vertices)
    CHECK(std::min(std::abs(p.z() - 0.62F), std::abs(p.z() - 0.51F)) < 1e-5F);
}

TEST_CASE("Labels of robots are voted") {
  const auto labels = [](LabelId a, LabelId b, LabelId c) {
    const FusedBox box =
        fuse({square(0, kUp, 0.61F, a), square(1, kUp, 0.61F, b), square(2, kUp, 0.61F, c)});
    CHECK(std::ranges::all_of(box.labels, [&](LabelId l) { return l == box.labels.front(); }));
    return box.labels.front();
  };
  CHECK(labels(4, 7, 7) == 7);
  CHECK(labels(4, 4, 7) == 4);
  CHECK(labels(0, 0, 7) == 7);  // unknown has no vote
  CHECK(labels(0, 0, 0) == 0);
}

TEST_CASE("Boxes compute the same vertices on their common side") {
  const Eigen::Vector3f shift(0.8F, 0.0F, 0.0F);  // half of it in each box
  RobotSurface surface = square(0, Eigen::Vector3f(0.1F, 0.2F, 1.0F).normalized(), 0.6F);
  for (Triangle& triangle : surface.triangles)
    for (Eigen::Vector3f& p : triangle.corners) p += shift;
  SurfaceFusion fusion(kVoxel_m);
  const FusedBox left = fusion.fuse({0, 0, 0}, std::span(&surface, 1)),
                 right = fusion.fuse({1, 0, 0}, std::span(&surface, 1));
  int shared = 0;
  for (std::size_t a = 0; a < left.edges.size(); ++a)
    for (std::size_t b = 0; b < right.edges.size(); ++b)
      if (left.edges[a] == right.edges[b]) {
        ++shared;
        CHECK(left.vertices[a] == right.vertices[b]);
      }
  CHECK(shared > 8);
}

}  // namespace km
