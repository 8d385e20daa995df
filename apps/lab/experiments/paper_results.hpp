#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace km {

/// Table II of one world. Keypoints and images are those of a centralised system.
struct PaperResources {
  int poses, edges;
  double place_recognition_mb, verification_mb, pgo_mb, total_mb;
  double images_mb, keypoints_mb;
  int rbcd_rounds;
  double rbcd_s, rbcd50_s, se_sync_s;
};

/// Values for one world from Chang, Tian, How and Carlone, "Kimera-Multi: a System for Distributed
/// Multi-Robot Metric-Semantic Simultaneous Localization and Mapping", ICRA 2021.
struct PaperWorld {
  const char* world;  ///< As in config/experiments/worlds.yaml.
  /// Table I, in the order local PGO, RBCD, RBCD stopped after 50 rounds, DGS, SE-Sync.
  std::array<double, 5> ate_m;
  std::array<double, 5> cost;
  PaperResources resources;
};

/// Table III: right labels before and after the correction of the mesh [%], of robots 0 to 2 and
/// of all together.
struct PaperLabels {
  const char* world;
  std::array<double, 4> before_percent, after_percent;
};

/// Largest share of the bytes of all keypoints that the paper's robots send in a world, Table II.
inline constexpr double kPaperMostShare_percent = 38.0;

/// nullptr for a world that is not in the paper.
[[nodiscard]] const PaperWorld* paper_world(const std::string& world);
[[nodiscard]] const PaperLabels* paper_labels(const std::string& world);

/// RMSE of the positions of all robots under one rigid alignment [m], on a graph of COSMO-Bench, in
/// the tables of UMich-RobotExploration/variable-projection (examples/data/analysis/): centralised,
/// without priors, from chained odometry.
struct PublishedTeamErrors {
  const char* set;                  ///< Name of the file without its extension.
  std::vector<double> irls_gnc_m;   ///< Variants of iteratively reweighted GNC.
  std::vector<double> gtsam_gnc_m;  ///< GTSAM's GNC, Geman-McClure; empty if not published.
};

/// nullptr for a set without published values.
[[nodiscard]] const PublishedTeamErrors* published_team_errors(const std::string& set);

/// Column of a method of config/experiments/trajectory.yaml in Table I, by its name.
[[nodiscard]] std::optional<std::size_t> paper_column(const std::string& method);

/// Absolute trajectory error of Kimera-VIO on a recording [m], as published by Rosinol et al.,
/// "Kimera: an Open-Source Library for Real-Time Metric-Semantic Localization and Mapping", ICRA
/// 2020; nullopt for recordings other than those of the Vicon rooms.
[[nodiscard]] std::optional<double> published_odometry_error_m(const std::string& recording);

}  // namespace km
