#include "apps/viewer/run_playback.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "apps/result_files.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/journal/restored_run.hpp"
#include "modules/map_2d/map_server_files.hpp"
#include "modules/mesh/map_file.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/objects/object_file.hpp"
#include "modules/view/view_content.hpp"
#include "modules/view/view_selector.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Makes the updates of one robot from the entries of its journal.
class RobotPlayback {
 public:
  void take(StoredEntry stored) {
    time_ = std::max(time_, stored.time);  // the clock may have been set back
    if (auto* const keyframe = std::get_if<Keyframe>(&stored.entry)) keyframe->features = {};
    restorer_.take(stored);
    std::visit([this](auto& entry) { show(entry); }, stored.entry);
    send(0.0);
  }

  /// All updates, ascending by time. Call once, after the last entry. Precondition: not empty.
  std::vector<ViewUpdate> finish(const LabelledMesh& map, const LabelledMesh& optimized) {
    send(ViewSelector::kKeyframePeriod_s);
    add_meshes(map, optimized);
    std::ranges::stable_sort(updates_, {}, &ViewUpdate::sent);
    return std::move(updates_);
  }
  /// True if no process has begun.
  [[nodiscard]] bool is_empty() const { return !selector_; }
  [[nodiscard]] RobotId robot() const { return robot_; }
  /// Robot whose odometry frame is the frame of the results.
  [[nodiscard]] RobotId anchor() const {
    return cells_.empty() ? robot_ : cells_.back().second.anchor;
  }
  void add_at_end(ViewContent content) { add(time_, std::move(content)); }

 private:
  // A resumed process sends what it has restored.
  void show(const JournalStart& start) {
    if (selector_ && start.boot == boot_) return;
    const bool is_resumed = selector_.has_value();
    robot_ = start.robot;
    boot_ = start.boot;
    selector_.emplace(robot_);
    if (!is_resumed) return;
    const RestoredRun run = RunRestorer(restorer_).finish();
    for (const ClosureOutcome& outcome : run.outcomes) selector_->add(outcome);
    for (const KeyframeOdometry& keyframe : run.odometry) selector_->add(keyframe);
    for (const Closure& closure : run.closures) selector_->add(closure);
  }
  void show(const JournalPeer& peer) {
    const std::uint64_t before =
        std::exchange(peers_.try_emplace(peer.robot, peer.boot).first->second, peer.boot);
    if (!is_same_incarnation(before, peer.boot)) selector_->restarted(peer.robot);
  }
  void show(const Keyframe& /*features*/) {}
  void show(const ReceivedFix& /*fix*/) {}
  void show(MeshCells& cells) { cells_.emplace_back(time_, std::move(cells)); }
  void show(const auto& event) { selector_->add(event); }

  // Takes all updates that are due `later_s` after the newest entry.
  void send(double later_s) {
    while (auto content = selector_->next(1e-9 * static_cast<double>(time_) + later_s))
      add(time_, *std::move(content));
  }

  void add(Stamp time, ViewContent content) {
    updates_.push_back({robot_, boot_, time, std::move(content)});
  }

  // Adds the chunks of the meshes at the times of the events that state their cells. Chunks whose
  // cells are in no event are added at the end of the run.
  void add_meshes(const LabelledMesh& map, const LabelledMesh& optimized) {
    const RobotId last = anchor();
    std::set<MeshChunkKey> shown;
    std::optional<RobotId> present;  // anchor of the shown chunks
    const auto show_all = [&](Stamp time, const LabelledMesh& mesh,
                              const std::set<MeshCells::Cell>* cells) {
      for (MeshChunk& chunk : split_mesh(mesh, robot_, *present, ChunkGrid{}).chunks)
        if ((cells == nullptr || cells->contains(chunk.key.cell)) && shown.insert(chunk.key).second)
          add(time, std::move(chunk));
    };
    for (const auto& [time, mesh] : cells_) {
      if (std::exchange(present, mesh.anchor) != mesh.anchor)
        for (const MeshChunkKey& key : std::exchange(shown, {})) add(time, MeshChunk{.key = key});
      const std::set<MeshCells::Cell> cells(mesh.cells.begin(), mesh.cells.end());
      if (mesh.anchor == last)
        show_all(time, optimized, &cells);
      else if (mesh.anchor == robot_)
        show_all(time, map, &cells);
    }
    if (!present) present = last;
    show_all(time_, optimized, nullptr);
  }

  RunRestorer restorer_;
  RobotId robot_ = 0;
  std::uint64_t boot_ = 0;
  std::optional<ViewSelector> selector_;
  std::map<RobotId, std::uint64_t> peers_;
  std::vector<std::pair<Stamp, MeshCells>> cells_;
  Stamp time_ = 0;  // time of the newest entry
  std::vector<ViewUpdate> updates_;
};

// Reads the journal of a robot, up to an entry that contradicts the former ones.
RobotPlayback read_robot(const fs::path& folder, std::vector<std::string>& notes) {
  RobotPlayback robot;
  const fs::path file = folder / kJournal;
  if (!is_file(folder / kSummary)) notes.push_back(unfinished(folder) + "; " + way_on(folder));
  try {
    const JournalExtent read =
        read_journal(file, [&](StoredEntry stored) { robot.take(std::move(stored)); });
    for (const JournalDamage& damage : read.damages) notes.push_back(to_string(damage, file));
  } catch (const std::invalid_argument& error) {
    notes.push_back(file.string() + ": " + error.what());
  } catch (const InputFileError& error) {
    notes.emplace_back(error.what());
  }
  return robot;
}

// The value of an optional file: a default value if there is none. `notes` names a file that
// cannot be read, and states why.
template <typename Read>
auto read_if_there(const std::filesystem::path& file, std::vector<std::string>& notes,
                   const Read& read) try {
  return is_there(file) ? read(file) : decltype(read(file))();
} catch (const std::exception& error) {
  const std::string what = error.what(), name = file.string();
  notes.push_back(what.starts_with(name) ? what : name + ": " + what);
  return decltype(read(file))();
}

OccupancyGrid read_image(const fs::path& file) try {
  return map_of_image(read_input_file(file));
} catch (const std::invalid_argument& error) {
  throw std::runtime_error(file.string() + ": " + error.what());
}

OccupancyGrid read_map_2d(const fs::path& file, RobotId anchor) {
  OccupancyGrid map = read_image(file.parent_path() / kMap2dImage);
  const YAML::Node yaml = YAML::Load(read_input_file(file));
  map.resolution_m = yaml["resolution"].as<double>();
  map.origin = {yaml["origin"][0].as<double>(), yaml["origin"][1].as<double>()};
  map.z_m = yaml["floor_z"].as<double>(0.0);
  map.anchor = anchor;
  return map;
}

LabelledMesh read_shown(const fs::path& file, std::vector<std::string>& notes) {
  return without_far_vertices(read_mesh(file), file.string(), notes);
}

// The content if a robot could send it. Numbers in files may be impossible.
std::optional<ViewContent> checked_content(std::optional<ViewContent> content) {
  if (!content || !decode_view(encode_view(*content)))
    throw std::runtime_error("its values are impossible");
  return content;
}

// The objects and the 2D map. `anchor`: robot whose odometry frame is the frame of the 2D map.
// Files that are missing are left out.
std::vector<ViewContent> read_layers(const fs::path& folder, RobotId anchor,
                                     std::vector<std::string>& notes) {
  std::vector<ViewContent> layers;
  const auto add = [&](const char* name, const auto& read) {
    auto content = read_if_there(folder / name, notes,
                                 [&](const fs::path& file) { return checked_content(read(file)); });
    if (content) layers.push_back(*std::move(content));
  };
  add(kObjectsFile, [](const fs::path& file) { return view_objects(read_object_list(file)); });
  add(kMap2d, [&](const fs::path& file) { return view_raster(read_map_2d(file, anchor)); });
  return layers;
}

// The chunks of the fused mesh of the team. Their key has another robot id than `robot`, so that
// they replace no chunk of the mesh of the robot.
std::vector<MeshChunk> read_team_mesh(const fs::path& folder, RobotId robot, RobotId anchor,
                                      std::vector<std::string>& notes) {
  const auto other = static_cast<RobotId>(robot ^ 1U);
  return read_if_there(folder / kTeamMesh, notes, [&](const fs::path& file) {
    return split_mesh(read_shown(file, notes), other, anchor, ChunkGrid{}).chunks;
  });
}

std::vector<fs::path> folders_of_robots(const fs::path& folder) {
  if (is_file(folder))
    throw std::runtime_error(
        folder.string() +
        ": a file, not the folder of a run; Foxglove and kimera_multi_evaluate "
        "open records (.mcap)");
  if (!is_folder(folder)) throw std::runtime_error(folder.string() + ": no such folder");
  std::vector<fs::path> folders = robot_folders(folder);
  if (folders.empty())
    throw std::runtime_error(folder.string() +
                             ": no results in it: no run.journal, nor folders that have one; give "
                             "the --output of kimera_multi_team or of a robot");
  return folders;
}

// Shifts the times of all updates so that the first is `begin`, and shortens pauses to kMaxPause_s.
void shift_and_shorten(Stamp begin, std::vector<ViewUpdate>& updates) {
  const Stamp most = nanoseconds(kMaxPause_s);
  Stamp before = updates.empty() ? 0 : updates.front().sent, now = begin;
  for (ViewUpdate& update : updates) {
    now += std::min(update.sent - before, most);
    before = std::exchange(update.sent, now);
  }
}

}  // namespace

RunPlayback read_run(const fs::path& folder, Stamp begin) {
  RunPlayback run;
  std::set<RobotId> robots, fused;  // fused: anchors whose fused mesh is read
  for (const fs::path& one : folders_of_robots(folder)) {
    RobotPlayback robot = read_robot(one, run.notes);
    if (robot.is_empty()) continue;
    const auto map = read_if_there(one / kMapFile, run.notes, [&](const fs::path& file) {
      return without_far_vertices(read_map_file(file).mesh, file.string(), run.notes);
    });
    const auto optimized =
        read_if_there(one / "mesh_optimized.ply", run.notes,
                      [&](const fs::path& file) { return read_shown(file, run.notes); });
    for (ViewContent& layer : read_layers(one, robot.anchor(), run.notes))
      robot.add_at_end(std::move(layer));
    if (!fused.contains(robot.anchor()))
      for (MeshChunk& chunk : read_team_mesh(one, robot.robot(), robot.anchor(), run.notes)) {
        fused.insert(robot.anchor());
        robot.add_at_end(std::move(chunk));
      }
    const std::vector<ViewUpdate> updates = robot.finish(map, optimized);
    if (!robots.insert(robot.robot()).second)
      throw std::runtime_error(folder.string() + ": two folders are of robot " +
                               std::to_string(robot.robot()) + ": give one run");
    run.updates.insert(run.updates.end(), updates.begin(), updates.end());
    if (run.palette.classes().empty())
      run.palette = read_if_there(one / kLabelPalette, run.notes, [](const fs::path& file) {
        return parse_label_palette(read_input_file(file), file.string());
      });
  }
  if (run.updates.empty())
    throw std::runtime_error(run.notes.empty() ? folder.string() + ": the journals are empty"
                                               : run.notes.front());
  std::ranges::stable_sort(run.updates, {}, &ViewUpdate::sent);
  shift_and_shorten(begin, run.updates);
  return run;
}

}  // namespace km
