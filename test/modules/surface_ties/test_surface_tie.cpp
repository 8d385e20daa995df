#include <catch2/catch.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/surface_ties/surface_tie.hpp"
#include "test/modules/surface_ties/rooms.hpp"

namespace km {
namespace {

// Errors of a mapped surface: along the normal of each vertex, equal over patches of half a metre.
void add_noise(LabelledMesh& mesh, double sigma_m, std::mt19937& random) {
  std::vector<Eigen::Vector3f> normals(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& [a, b, c] : mesh.faces) {
    const Eigen::Vector3f n =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    for (const std::uint32_t v : {a, b, c}) normals[v] += n;
  }
  std::normal_distribution<float> gauss(0.0F, static_cast<float>(sigma_m));
  std::map<std::array<int, 4>, float> error_of;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const Eigen::Array3f patch = (mesh.vertices[v].array() / 0.5F).floor();
    const std::array<int, 4> key = {static_cast<int>(patch.x()), static_cast<int>(patch.y()),
                                    static_cast<int>(patch.z()), mesh.labels[v]};
    const auto [entry, is_new] = error_of.try_emplace(key, 0.0F);
    if (is_new) entry->second = gauss(random);
    mesh.vertices[v] += entry->second * normals[v].normalized();
  }
}

// Samples of a mesh in the frame of a keyframe.
std::vector<SurfaceSample> seen_from(const LabelledMesh& mesh, const SE3& T_world_kf) {
  auto samples = sample_plane_patches(mesh, SurfaceTieOptions().spacing_m);
  transform(samples, T_world_kf.inverse());
  return samples;
}

const SE3 kT_world_a = make_pose(so3_exp({0.0, 0.1, 0.4}), {1.5, 1.2, 1.0});
const SE3 kT_world_b = make_pose(so3_exp({0.1, 0.0, -0.9}), {2.3, 1.7, 1.1});
const SE3 kT_a_b = kT_world_a.inverse() * kT_world_b;

// 5 cm and 1 degree, in varying directions.
SE3 misfit(std::mt19937& random) {
  std::normal_distribution<double> gauss;
  const auto unit = [&] {
    const double x = gauss(random), y = gauss(random), z = gauss(random);
    return Eigen::Vector3d(x, y, z).normalized();
  };
  const Eigen::Vector3d axis = unit();
  return make_pose(so3_exp(axis / kDegrees), 0.05 * unit());
}

double translation_error(const SurfaceTie& tie) {
  return (tie.T_a_b.translation() - kT_a_b.translation()).norm();
}

}  // namespace

TEST_CASE("The derivative of a pair's distance equals its numeric derivative", "[surface_tie]") {
  const SurfacePair pair{
      {1.0, -2.0, 0.5}, {0.2, 0.1, 3.0}, Eigen::Vector3d(0.3, -0.5, 0.8).normalized()};
  const Vector6 J = jacobian_of(pair, kT_a_b);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const Vector6 delta = kStep * Vector6::Unit(i);
    const double numeric =
        (residual_of(pair, kT_a_b * se3_exp(delta)) - residual_of(pair, kT_a_b * se3_exp(-delta))) /
        (2.0 * kStep);
    CHECK(J[i] == Approx(numeric).margin(1e-7));
  }
}

TEST_CASE("Two robots 5 cm and 1 degree apart in one room are tied to 5 mm", "[surface_tie]") {
  std::mt19937 random(GENERATE(range(1U, 6U)));
  LabelledMesh a = inside_of_room(), b = inside_of_room();
  add_noise(a, 0.005, random);
  add_noise(b, 0.005, random);
  const SurfaceTie tie =
      tie_surfaces(seen_from(a, kT_world_a), seen_from(b, kT_world_b), kT_a_b * misfit(random));
  REQUIRE(tie.status == SurfaceTieStatus::kTied);
  CHECK(translation_error(tie) < 0.005);
  CHECK(angle_of(tie.T_a_b.linear().transpose() * kT_a_b.linear()) < 0.2 / kDegrees);
}

TEST_CASE("The covariance of a tie is as large as its error", "[surface_tie]") {
  constexpr int kRuns = 40;
  SurfaceTieOptions options;
  options.correlation_m = 0.5;  // length of the patches of add_noise()
  options.bias_m = 1e-6;        // the meshes have none
  double sum = 0.0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    std::mt19937 random(seed);
    LabelledMesh a = inside_of_room(), b = inside_of_room();
    add_noise(b, 0.015, random);
    const SurfaceTie tie = tie_surfaces(seen_from(a, kT_world_a), seen_from(b, kT_world_b),
                                        kT_a_b * misfit(random), options);
    REQUIRE(tie.status == SurfaceTieStatus::kTied);
    const Vector6 error = se3_log(tie.T_a_b.inverse() * kT_a_b);
    sum += error.dot(tie.covariance.llt().solve(error));
  }
  const double per_direction = sum / kRuns / 6.0;  // 1, with a standard deviation of 0.09
  CHECK(per_direction > 0.5);
  CHECK(per_direction < 1.5);
}

TEST_CASE("A corridor is not tied along itself", "[surface_tie]") {
  std::mt19937 random(7);
  LabelledMesh a = corridor(), b = corridor();
  add_noise(a, 0.01, random);
  add_noise(b, 0.01, random);
  const Eigen::Vector3d shift(0.06, 0.03, -0.02);  // motion of b in `world`
  const SE3 guess = kT_world_a.inverse() * Eigen::Translation3d(shift) * kT_world_b;
  const SurfaceTie tie = tie_surfaces(seen_from(a, kT_world_a), seen_from(b, kT_world_b), guess);
  REQUIRE(tie.status == SurfaceTieStatus::kSlides);
  CHECK(tie.free_directions == 1);
  const SE3 T_world_b = kT_world_a * tie.T_a_b;
  const Eigen::Vector3d moved = T_world_b.translation() - kT_world_b.translation();
  CHECK(moved.x() == Approx(shift.x()).margin(0.01));  // as in the guess
  CHECK(std::hypot(moved.y(), moved.z()) < 0.01);
  const Eigen::Matrix3d Sigma_world = T_world_b.linear() *
                                      tie.covariance.bottomRightCorner<3, 3>() *
                                      T_world_b.linear().transpose();
  CHECK(Sigma_world(0, 0) > 1e3);
  CHECK(Sigma_world(1, 1) < 1e-3 * Sigma_world(0, 0));
}

TEST_CASE("Similar but different surfaces are not tied", "[surface_tie]") {
  const auto status = [](const LabelledMesh& other) {
    return tie_surfaces(seen_from(inside_of_room(), kT_world_a), seen_from(other, kT_world_b),
                        kT_a_b)
        .status;
  };
  SECTION("a room that is longer by 20 cm") {
    CHECK(status(inside_of_room(4.2F)) == SurfaceTieStatus::kMisfit);
  }
  SECTION("a room with other labels") {
    LabelledMesh other = inside_of_room();
    for (LabelId& label : other.labels) label = static_cast<LabelId>(label + 1);
    CHECK(status(other) == SurfaceTieStatus::kTooLittle);
  }
  SECTION("the same room from outside: the other side of thin walls") {
    LabelledMesh other = inside_of_room();
    for (auto& face : other.faces) std::swap(face[1], face[2]);
    CHECK(status(other) == SurfaceTieStatus::kTooLittle);
  }
}

}  // namespace km
