#include "modules/constellations/constellation_match.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/modules/constellations/scenes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Two maps of one scene, and the true relative pose.
struct TwoMaps {
  std::vector<Landmark> a, b;
  SE3 T_a_b = SE3::Identity();
};

TwoMaps two_maps(const std::vector<TrueObject>& scene, const MapErrors& errors_a,
                 const MapErrors& errors_b, std::mt19937& rng) {
  TwoMaps maps;
  const SE3 T_scene_a = random_upright(rng);
  const SE3 T_scene_b = random_upright(rng);
  maps.a = map_of(scene, T_scene_a, errors_a, rng);
  maps.b = map_of(scene, T_scene_b, errors_b, rng);
  maps.T_a_b = T_scene_a.inverse() * T_scene_b;
  return maps;
}

// Squared normalised error of yaw and translation, which has 4 degrees of freedom.
double squared_error(const UncertainPose& estimate, const SE3& truth) {
  const Vector6 error = se3_log(estimate.T.inverse() * truth);
  return error.tail<4>().dot(estimate.Sigma.bottomRightCorner<4, 4>().inverse() * error.tail<4>());
}

}  // namespace

TEST_CASE(
    "The relative pose is found or refused, never wrong, with any yaw, missing and extra objects") {
  const bool is_street = GENERATE(false, true);
  CAPTURE(is_street);
  constexpr int kScenes = 60;
  constexpr double kChi4_0_99999 = 28.5;  // 4 degrees of freedom
  int found = 0;
  std::mt19937 rng(5);
  const MapErrors errors{.found = 0.85, .false_objects = 3};
  for (int n = 0; n < kScenes; ++n) {
    CAPTURE(n);
    const TwoMaps maps = two_maps(is_street ? street(rng) : square(20, rng), errors, errors, rng);
    const ConstellationMatch match = match_constellations(maps.a, maps.b);
    if (match.status != ConstellationStatus::kMatched) continue;
    ++found;
    CHECK(squared_error(match.T_a_b, maps.T_a_b) < kChi4_0_99999);
  }
  CHECK(found >= (is_street ? 40 : 50));
}

TEST_CASE("Maps of two streets have no match") {
  std::mt19937 rng(11);
  for (int n = 0; n < 200; ++n) {
    CAPTURE(n);
    const auto a = map_of(street(rng), random_upright(rng), {.found = 0.85}, rng);
    const auto b = map_of(street(rng), random_upright(rng), {.found = 0.85}, rng);
    CHECK(match_constellations(a, b).status != ConstellationStatus::kMatched);
  }
}

TEST_CASE("A symmetric constellation is ambiguous") {
  // Equal objects on a circle at irregular angles, and again half a turn later.
  std::mt19937 rng(7);
  std::vector<TrueObject> scene;
  for (int n = 0; n < 8; ++n) {
    const double angle = 0.39 * n + drawn(rng, -0.1, 0.1), radius = drawn(rng, 8.0, 18.0);
    for (const double sign : {-1.0, 1.0})
      scene.push_back(
          {1, {sign * radius * std::cos(angle), sign * radius * std::sin(angle), 1.5}, size_of(1)});
  }
  const TwoMaps maps = two_maps(scene, {}, {}, rng);
  const ConstellationMatch match = match_constellations(maps.a, maps.b);
  CHECK(match.status == ConstellationStatus::kAmbiguous);
  CHECK(match.second_pairs >= 14);
}

TEST_CASE("A corridor of equal objects is refused, also if some are missing") {
  const auto seed = GENERATE(range(0U, 20U));
  const auto found = GENERATE(1.0, 0.9, 0.75);
  CAPTURE(seed, found);
  std::mt19937 rng(seed);
  std::vector<TrueObject> scene;
  for (int n = 0; n < 12; ++n)
    for (const double side : {-2.0, 2.0}) scene.push_back({1, {3.0 * n, side, 1.5}, size_of(1)});
  const MapErrors errors{.found = found};
  const TwoMaps maps = two_maps(scene, errors, errors, rng);
  CHECK(match_constellations(maps.a, maps.b).status != ConstellationStatus::kMatched);
}

TEST_CASE("The covariance is honest for independent errors and for shifts that a map shares") {
  constexpr int kCases = 500;
  const bool is_shifted = GENERATE(false, true);
  CAPTURE(is_shifted);
  std::mt19937 rng(9);
  double sum = 0.0;
  int matched = 0;
  for (int n = 0; n < kCases; ++n) {
    MapErrors a, b;
    if (is_shifted)
      for (MapErrors* errors : {&a, &b})
        for (double& s : errors->shift) s = normal(rng);
    const TwoMaps maps = two_maps(square(20, rng), a, b, rng);
    const ConstellationMatch match = match_constellations(maps.a, maps.b);
    if (match.status != ConstellationStatus::kMatched) continue;
    ++matched;
    sum += squared_error(match.T_a_b, maps.T_a_b) / 4.0;
  }
  CHECK(matched >= 0.9 * kCases);
  // Shifts count once as independent and once as shared, so each case alone has less than stated.
  // The mean of 500 values, of 4 degrees of freedom each, has a standard deviation of 0.03.
  const double mean = sum / matched;
  CHECK(mean < 1.1);
  CHECK(mean > (is_shifted ? 0.3 : 0.05));
}

TEST_CASE("Constellations without objects, and of one place only, are refused") {
  CHECK(match_constellations({}, {}).status == ConstellationStatus::kTooFew);
  const std::vector<Landmark> heap(20, Landmark{.label = 3, .size_m = {4, 2, 2}});
  CHECK(match_constellations(heap, heap).status == ConstellationStatus::kTooFew);
}

TEST_CASE("Landmarks that are not finite are refused with their label") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<Landmark> good = {{.label = 7}};
  for (const Landmark& one :
       {Landmark{.label = 7, .center = {0.0, kNan, 0.0}},
        Landmark{.label = 7, .size_m = {1.0, 1.0, kInfinity}}, Landmark{.label = 7, .sigma_m = 0.0},
        Landmark{.label = 7, .side_shift_m = kInfinity}}) {
    const std::vector<Landmark> bad = {one};
    CHECK_THROWS_WITH(match_constellations(good, bad), Contains("label 7"));
    CHECK_THROWS_WITH(match_constellations(bad, good), Contains("label 7"));
  }
}

}  // namespace km
