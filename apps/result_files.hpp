#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/io/input_file.hpp"

namespace km {

/// Names and colours of the labels, beside a labelled mesh.
inline constexpr const char* kLabelPalette = "label_palette.csv";

/// The 2D map, and its image.
inline constexpr const char* kMap2d = "map.yaml";
inline constexpr const char* kMap2dImage = "map.pgm";

/// Written at the end of a run.
inline constexpr const char* kSummary = "summary.json";

/// The fused mesh of a team, in its folder, and with `map.team` in that of each robot.
inline constexpr const char* kTeamMesh = "team_mesh.ply";
/// The 2D map of that mesh, in the folder of each robot.
inline constexpr const char* kTeamMap2d = "team_map.yaml";
inline constexpr const char* kTeamMap2dImage = "team_map.pgm";

/// Objects of the map, with labels only.
inline constexpr const char* kObjectsFile = "objects.json";

/// Results of a robot in its output folder.
inline constexpr std::array kResultFiles = {
    "odometry.tum",   "live.tum",      "optimized.tum",      "optimized_keyframes.tum",
    "pose_graph.g2o", "keyframes.csv", "loop_closures.csv",  "optimizer.csv",
    "traffic.csv",    "process.csv",   "timing.csv",         "config.yaml",
    kSummary,         "mesh.ply",      "mesh_optimized.ply", kLabelPalette,
    kTeamMesh,        kObjectsFile,    kMap2dImage,          kMap2d,
    kTeamMap2d,       kTeamMap2dImage};

/// Results that grow during the run, and continue when it is resumed.
inline constexpr std::array kGrowingFiles = {"optimizer.csv", "traffic.csv", "process.csv"};

/// The rig with the stamps and mounting of the cameras as estimated by a run, for --rig of the next
/// run. That run may have the same folder, so the file stays until it is replaced.
inline constexpr const char* kEstimatedRig = "rig_estimated.yaml";

/// Input of --resume and --session.
inline constexpr const char* kJournal = "run.journal";

/// Appended to the name of a journal with flipped bytes: its copy before the run continued.
inline constexpr const char* kDamaged = ".damaged";

/// The map of such a run.
inline constexpr const char* kMapFile = "run.map";

/// Record for viewers. A resumed run continues in record_2.mcap, and so on.
inline constexpr const char* kRecord = "record.mcap";

/// The folders that robots write or have written to: `folder` itself, or those in it, by name.
[[nodiscard]] inline std::vector<std::filesystem::path> robot_folders(
    const std::filesystem::path& folder) {
  const auto is_of_robot = [](const std::filesystem::path& one) {
    return is_file(one / kSummary) || is_file(one / kJournal);
  };
  if (is_of_robot(folder)) return {folder};
  std::vector<std::filesystem::path> found = entries_of(folder);
  std::erase_if(found, std::not_fn(is_of_robot));
  return found;
}

/// Error text for the folder of a robot without a summary.
[[nodiscard]] inline std::string unfinished(const std::filesystem::path& folder) {
  return folder.string() + ": no " + kSummary + ": the robot still runs, or was killed";
}

/// Remedy for that error.
[[nodiscard]] inline std::string way_on(const std::filesystem::path& folder) {
  return "if it was killed: the same command with --resume " + folder.string() +
         " in place of --output continues it";
}

/// "record_2.mcap" of "record.mcap".
[[nodiscard]] inline std::filesystem::path numbered(const std::filesystem::path& file, int number) {
  const std::string name = file.stem().string() + '_' + std::to_string(number);
  return file.parent_path() / (name + file.extension().string());
}

/// Reserve room for results that are written at the end; removed then.
inline constexpr const char* kTrajectoryRoom = ".room_for_trajectories";
inline constexpr const char* kSummaryRoom = ".room_for_summary";

/// Throws std::runtime_error if `folder` has neither summary nor journal, but a file with the name
/// of a result: no run has written this file, so none may replace it. Empty files may go.
inline void expect_no_other_files(const std::filesystem::path& folder) {
  if (is_file(folder / kSummary) || is_file(folder / kJournal)) return;
  for (const std::string file : kResultFiles)
    // A run that has just begun has this file before its journal.
    if (file != "config.yaml" && is_file(folder / file) &&
        !std::filesystem::is_empty(folder / file))
      throw std::runtime_error(
          (folder / file).string() +
          ": would be replaced, and is of no run, because the folder has neither " + kSummary +
          " nor " + kJournal + "; choose another folder");
}

/// Removes a robot's results from `folder`, except for its journal and map, so that those of an
/// earlier run are not mistaken for those of one that fails. If the run continues (`continues`),
/// its growing files stay, too; otherwise expect_no_other_files(). Throws
/// std::filesystem::filesystem_error naming the file.
inline void remove_results(const std::filesystem::path& folder, bool continues = false) {
  if (!continues) expect_no_other_files(folder);
  for (const std::string file : kResultFiles) {
    if (continues && std::ranges::find(kGrowingFiles, file) != kGrowingFiles.end()) continue;
    for (const char* ending : {"", ".part"})  // file cut short by the end of the process
      std::filesystem::remove(folder / (file + ending));
  }
  if (continues) return;
  std::filesystem::remove(folder / kRecord);
  for (int number = 2; std::filesystem::remove(numbered(folder / kRecord, number));) ++number;
}

}  // namespace km
