#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace km {

/// A JRL document of two robots in the form of COSMO-Bench's files: a has three poses, b has two.
/// Each has a prior and odometry of 1 m forwards. One closure is inside a (entry 2, measurement 1).
/// One from b1 to a1 is in the lists of both robots (a: entry 3, measurement 0; b: entry 1,
/// measurement 1). One from b1 to a2 is labelled false (b: entry 1, measurement 2). The truth is
/// the odometry, with b 2 m to the left of a.
class SmallJrl {
 public:
  using Json = nlohmann::json;
  static constexpr std::uint64_t kA = std::uint64_t{'a'} << 56U;
  static constexpr std::uint64_t kB = std::uint64_t{'b'} << 56U;
  static constexpr std::int64_t kStart = 1'600'000'000'000'000'000;  // [ns]

  Json document = {
      {"name", "small"},
      {"robots", {97, 98}},
      {"measurements", measurements()},
      {"groundtruth",
       {{"a", {pose(kA, 0, 0), pose(kA + 1, 1, 0), pose(kA + 2, 2, 0)}},
        {"b", {pose(kA + 1, 9, 9), pose(kB, 0, 2), pose(kB + 1, 1, 2)}}}},
      {"initialization", {{"a", {pose(kA, 0, 0)}}, {"b", {pose(kB, 0, 2.5)}}}},
      {"potential_outlier_factors", {{"a", {{2, 1}, {3, 0}}}, {"b", {{1, 1}, {1, 2}}}}},
      {"outlier_factors", {{"a", Json::array()}, {"b", {{1, 2}}}}}};

  [[nodiscard]] std::string text() const { return document.dump(1); }

  static Json pose(double x, double y) {
    return {{"type", "Pose3"}, {"translation", {x, y, 0.0}}, {"rotation", {1.0, 0.0, 0.0, 0.0}}};
  }
  static Json pose(std::uint64_t key, double x, double y) {
    Json value = pose(x, y);
    value["key"] = key;
    return value;
  }
  /// Standard deviations of 0.01 rad and 0.1 m for all axes.
  static Json covariance() {
    Json rows = std::vector<double>(36, 0.0);
    for (int i = 0; i < 6; ++i) rows[static_cast<std::size_t>(7 * i)] = i < 3 ? 1e-4 : 1e-2;
    return rows;
  }
  static Json between(std::uint64_t key1, std::uint64_t key2, double x, double y) {
    return {{"type", "BetweenFactorPose3"},
            {"key1", key1},
            {"key2", key2},
            {"measurement", pose(x, y)},
            {"covariance", covariance()}};
  }

 private:
  static Json prior(std::uint64_t key) {
    return {{"type", "PriorFactorPose3"},
            {"key", key},
            {"prior", pose(0, 0)},
            {"covariance", covariance()}};
  }
  static Json entry(std::int64_t after_ns, const std::vector<Json>& measurements) {
    return {{"stamp", kStart + after_ns}, {"measurements", measurements}};
  }
  static Json measurements() {
    const Json shared = between(kB + 1, kA + 1, 0, -2);
    return {{"a",
             {entry(0, {prior(kA)}), entry(10, {between(kA, kA + 1, 1, 0)}),
              entry(20, {between(kA + 1, kA + 2, 1, 0), between(kA, kA + 2, 2, 0)}),
              entry(30, {shared})}},
            {"b",
             {entry(5, {prior(kB)}),
              entry(15, {between(kB, kB + 1, 1, 0), shared, between(kB + 1, kA + 2, 7, 7)})}}};
  }
};

}  // namespace km
