#include "modules/evaluation/segment_error.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "test/modules/evaluation/trajectories.hpp"

namespace km {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// `count` pairs of a truth and an estimate of it.
template <typename Truth, typename Estimate>
std::vector<PosePair> pairs_of(int count, const Truth& truth, const Estimate& estimate) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < count; ++i) pairs.push_back({i * kSecond / 10, truth(i), estimate(i)});
  return pairs;
}

}  // namespace

TEST_CASE("Drift lengths are those of 1, 2, 5 that fit half the path", "[segment_error]") {
  CHECK(segment_lengths(300.0) == std::vector<double>{10.0, 20.0, 50.0, 100.0});
  CHECK(segment_lengths(5.43) == std::vector<double>{0.2, 0.5, 1.0, 2.0});
  CHECK(segment_lengths(0.05).size() == 2);
  CHECK(segment_lengths(0.0).empty());
}

TEST_CASE("A straight line of the wrong scale drifts by exactly that", "[segment_error]") {
  const double scale = GENERATE(0.9, 1.0, 1.03);
  const double step_m = 0.3;  // no divisor of the lengths
  const auto line = [=](double by) {
    return [=](int i) { return make_pose(so3_exp({0.1, 0.2, 0.3}), {by * step_m * i, 0.0, 0.0}); };
  };
  const auto errors = segment_errors(pairs_of(200, line(1.0), line(scale)));
  REQUIRE_FALSE(errors.translation_percent.empty());
  CHECK(errors.lengths_m == std::vector<double>{2.0, 5.0, 10.0, 20.0});
  for (std::size_t i = 0; i < errors.translation_percent.size(); ++i) {
    CHECK(errors.translation_percent[i] == Approx(100.0 * std::abs(scale - 1.0)).margin(1e-9));
    CHECK(errors.rotation_deg_per_m[i] == Approx(0.0).margin(1e-6));
  }
  const auto corrected = segment_errors(pairs_of(200, line(1.0), line(scale)), 1.0 / scale);
  for (const double percent : corrected.translation_percent)
    CHECK(percent == Approx(0.0).margin(1e-9));
}

TEST_CASE("A constant turn too much is seen per metre", "[segment_error]") {
  const double step_m = 0.25;
  const double turn = 0.002;  // [rad] a step
  const auto truth = [=](int i) {
    return make_pose(Eigen::Matrix3d::Identity(), {step_m * i, 0, 0});
  };
  const auto turned = [=](int i) {
    return make_pose(so3_exp({0.0, 0.0, turn * i}), {step_m * i, 0, 0});
  };
  const auto errors = segment_errors(pairs_of(100, truth, turned));
  for (const double rate : errors.rotation_deg_per_m)
    CHECK(rate == Approx(kDegrees * turn / step_m).epsilon(1e-9));
}

TEST_CASE("Drift does not depend on the frame of the estimate", "[segment_error]") {
  const SE3 T_other = make_pose(so3_exp({0.5, -0.3, 1.1}), {10.0, -4.0, 2.0});
  const auto truth = [](int i) { return curve(0.05 * i); };
  const auto estimate = [](int i) {
    return curve(0.05 * i) * make_pose(so3_exp({0.001 * i, 0.0, 0.0}), {0.0, 0.002 * i, 0.0});
  };
  const auto moved = [&](int i) { return T_other * estimate(i); };
  const auto a = segment_errors(pairs_of(200, truth, estimate));
  const auto b = segment_errors(pairs_of(200, truth, moved));
  REQUIRE(a.translation_percent.size() == b.translation_percent.size());
  for (std::size_t i = 0; i < a.translation_percent.size(); ++i)
    CHECK(a.translation_percent[i] == Approx(b.translation_percent[i]).margin(1e-9));
}

TEST_CASE("Lengths beyond the path give nothing, bad ones are refused", "[segment_error]") {
  const auto line = [](int i) { return make_pose(Eigen::Matrix3d::Identity(), {0.1 * i, 0, 0}); };
  const auto pairs = pairs_of(11, line, line);
  const double lengths_m[] = {0.5, 2.0};
  const auto errors = segment_errors(pairs, lengths_m);
  CHECK(errors.lengths_m == std::vector<double>{0.5});
  const double bad[] = {0.0};
  CHECK_THROWS_AS(segment_errors(pairs, bad), std::invalid_argument);
  CHECK(segment_errors(std::vector<PosePair>{}).lengths_m.empty());
}

}  // namespace km
