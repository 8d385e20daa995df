#include "apps/lab/experiments/paper_results.hpp"

#include <algorithm>
#include <utility>

namespace km {
namespace {

constexpr std::array kWorlds = {
    PaperWorld{"city",
               {6.09, 2.38, 2.88, 2.62, 1.46},
               {168532, 1113.1, 3192.9, 1207.2, 1047.3},
               {3238, 3428, 16.43, 36.80, 4.27, 57.50, 1989.4, 149.48, 500, 34.90, 2.76, 2.23}},
    PaperWorld{"camp",
               {2.81, 2.28, 2.52, 2.58, 2.28},
               {96695, 140.45, 140.97, 171.03, 140.32},
               {5189, 5411, 40.01, 9.59, 1.17, 50.77, 3188.1, 242.66, 128, 33.16, 6.49, 4.34}},
    PaperWorld{"v1",
               {0.455, 0.317, 0.348, 0.346, 0.308},
               {6451.9, 96.97, 138.18, 91.97, 90.61},
               {1690, 1730, 9.52, 7.32, 0.16, 17.00, 1223.9, 73.76, 95, 3.02, 1.53, 0.33}},
    PaperWorld{"v2",
               {0.473, 0.453, 0.413, 0.503, 0.453},
               {432.42, 5.44, 7.19, 5.60, 5.15},
               {1526, 1544, 8.95, 8.63, 0.20, 17.78, 1105.1, 69.35, 173, 5.84, 1.72, 0.47}}};

constexpr std::array kLabels = {
    PaperLabels{"city", {85.52, 88.52, 85.74, 67.91}, {85.52, 85.65, 90.31, 83.93}},
    PaperLabels{"camp", {95.83, 96.65, 95.28, 94.22}, {94.67, 97.92, 95.42, 95.13}}};

constexpr std::array<const char*, 5> kMethods = {"local", "rbcd", "rbcd50", "dgs", "centralized"};

constexpr std::array<std::pair<const char*, double>, 6> kOdometry = {{{"V1_01", 0.08},
                                                                      {"V1_02", 0.11},
                                                                      {"V1_03", 0.12},
                                                                      {"V2_01", 0.07},
                                                                      {"V2_02", 0.10},
                                                                      {"V2_03", 0.19}}};

template <typename Rows>
auto find_world(const Rows& rows, const std::string& world) -> decltype(rows.data()) {
  for (const auto& row : rows)
    if (row.world == world) return &row;
  return nullptr;
}

}  // namespace

const PublishedTeamErrors* published_team_errors(const std::string& set) {
  static const std::vector<PublishedTeamErrors> kSets = {
      {"kth_r3_00_d06_d09_d10_wifi", {1.77}, {1.79}},
      {"kth_r3_00_d06_d09_d10_proradio", {1.10, 1.11}, {}},
      {"ntu_r3_02_d02_n04_n13_wifi", {2.70, 6.33, 147.0}, {2.31}},
      {"ntu_r3_02_d02_n04_n13_proradio", {3.32, 3.44, 112.0}, {}}};
  const auto found = std::find_if(kSets.begin(), kSets.end(),
                                  [&](const PublishedTeamErrors& row) { return row.set == set; });
  return found == kSets.end() ? nullptr : &*found;
}

const PaperWorld* paper_world(const std::string& world) {
  return find_world(kWorlds, world);
}

const PaperLabels* paper_labels(const std::string& world) {
  return find_world(kLabels, world);
}

std::optional<std::size_t> paper_column(const std::string& method) {
  const auto* const found = std::find(kMethods.begin(), kMethods.end(), method);
  if (found == kMethods.end()) return std::nullopt;
  return static_cast<std::size_t>(found - kMethods.begin());
}

std::optional<double> published_odometry_error_m(const std::string& recording) {
  for (const auto& [name, error_m] : kOdometry)
    if (recording == name) return error_m;
  return std::nullopt;
}

}  // namespace km
