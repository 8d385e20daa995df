#include "apps/viewer/run_playback.hpp"

#include <algorithm>
#include <exception>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

#include "apps/result_files.hpp"
#include "apps/robot/run_summary.hpp"
#include "apps/robot/run_tables.hpp"
#include "modules/core/input_file.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/mesh/ply_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kPoseInterval_s = 0.2;
constexpr double kMaxPoseGap_s = 0.5;  // largest gap of the estimate at a keyframe
constexpr std::size_t kMostClosures = 200, kMostKeyframes = 500;  // limits of one update

// Results of a robot; times are since its start [s].
struct RobotFiles {
  RobotId id = 0;
  RunSummary summary;
  std::vector<StampedPose> odometry, optimized;
  std::vector<KeyframeRecord> keyframes;
  std::vector<ClosureRecord> closures;
  std::vector<NumberRow> process, rounds;
  std::vector<TrafficRow> traffic;
  std::vector<ViewNumber> loads;
  LabelledMesh mesh, optimized_mesh;
};

std::vector<ViewNumber> read_loads(const fs::path& file, double seconds) {
  std::vector<ViewNumber> loads;
  for (const ModuleTiming& timing : read_timing(file))
    loads.push_back({timing.module, timing.total_s / std::max(seconds, 1e-3)});
  return loads;
}

// Reads the available results; `notes` list those that cannot be read.
RobotFiles read_robot(const fs::path& folder, std::vector<std::string>& notes) {
  RobotFiles robot;
  robot.summary = read_summary(folder / kSummary);
  robot.id = robot.summary.robot;
  const auto attempt = [&](auto& value, const char* name, const auto& read) {
    try {
      value = read(folder / name);
    } catch (const std::exception& error) {
      notes.emplace_back(error.what());
    }
  };
  attempt(robot.odometry, "odometry.tum", [](const fs::path& f) { return read_trajectory(f); });
  attempt(robot.optimized, "optimized.tum", [](const fs::path& f) { return read_trajectory(f); });
  attempt(robot.keyframes, "keyframes.csv", read_keyframes);
  attempt(robot.closures, "loop_closures.csv", read_closures);
  attempt(robot.process, "process.csv", [](const fs::path& f) { return read_number_rows(f, 3); });
  attempt(robot.rounds, "optimizer.csv", [](const fs::path& f) { return read_number_rows(f, 5); });
  attempt(robot.traffic, "traffic.csv", read_traffic);
  attempt(robot.loads, "timing.csv",
          [&](const fs::path& f) { return read_loads(f, robot.summary.seconds); });
  for (const auto& [mesh, name] :
       {std::pair{&robot.mesh, "mesh.ply"}, std::pair{&robot.optimized_mesh, "mesh_optimized.ply"}})
    if (is_there(folder / name)) attempt(*mesh, name, read_ply);
  return robot;
}

// Maps stamps of one robot to times of its process. Both run at the same speed unless the recording
// was played faster.
class RobotTimes {
 public:
  RobotTimes(const RobotFiles& robot, Stamp begin) : begin_(begin) {
    if (robot.odometry.empty()) return;
    first_ = robot.odometry.front().stamp;
    const double recorded_s = seconds_between(first_, robot.odometry.back().stamp);
    const double run_s = robot.process.empty() ? robot.summary.seconds : robot.process.back()[0];
    if (run_s > 0.0 && recorded_s > run_s) pace_ = run_s / recorded_s;
    end_of_data_s_ = recorded_s * pace_;
  }

  [[nodiscard]] double run_s(Stamp image) const { return pace_ * seconds_between(first_, image); }
  [[nodiscard]] Stamp stamp_at(double run_s) const { return begin_ + nanoseconds(run_s); }
  [[nodiscard]] double dataset_s(double run_s) const {
    return std::min(run_s, end_of_data_s_) / pace_;
  }
  [[nodiscard]] double end_of_data_s() const { return end_of_data_s_; }

 private:
  Stamp begin_;
  Stamp first_ = 0;
  double pace_ = 1.0;
  double end_of_data_s_ = 0.0;
};

std::vector<ViewNumber> sent_by_category(const TrafficUntil& traffic) {
  std::vector<ViewNumber> numbers;
  for (const auto& [category, bytes] : traffic.sent()) numbers.push_back({category, bytes});
  return numbers;
}

std::vector<ViewLink> links_of(const TrafficUntil& traffic) {
  std::vector<ViewLink> links;
  for (const auto& [robot, silent_s] : traffic.silent_s())
    links.push_back({robot, static_cast<float>(silent_s)});
  return links;
}

constexpr double kNever_s = std::numeric_limits<double>::infinity();
constexpr double kAnswer_s = 0.5;  // time from a candidate to its outcome

// Time of each row of optimizer.csv. Rounds of the robot alone are spread evenly until it joined.
// Later rounds are placed by the share of the bytes that were sent for them after joining.
std::vector<double> times_of_rounds(const RobotFiles& robot, double joined_s, double end_s) {
  const auto alone = static_cast<std::size_t>(std::count_if(
      robot.rounds.begin(), robot.rounds.end(), [](const NumberRow& r) { return r[2] < 2.0; }));
  std::vector<double> times_s;
  for (std::size_t i = 0; i < alone; ++i)
    times_s.push_back(std::min(joined_s, end_s) * static_cast<double>(i + 1) /
                      static_cast<double>(alone + 1));
  TrafficUntil until(robot.traffic);
  until.advance(joined_s);
  const double before = until.sent("pgo");
  TrafficUntil all(robot.traffic);
  all.advance(kNever_s);
  const double total = std::max(1.0, all.sent("pgo") - before);
  const auto rows = static_cast<double>(robot.rounds.size() - alone);
  for (const NumberRow& process : robot.process) {
    until.advance(process[0]);
    const double due = 1.0 + (until.sent("pgo") - before) / total * (rows - 1.0);
    while (process[0] >= joined_s && times_s.size() < robot.rounds.size() &&
           static_cast<double>(times_s.size() - alone + 1) <= due)
      times_s.push_back(process[0]);
  }
  times_s.resize(robot.rounds.size(), end_s);
  return times_s;
}

// Makes the updates of one robot.
class RobotPlayback {
 public:
  RobotPlayback(const RobotFiles& robot, Stamp begin, std::vector<ViewUpdate>& updates)
      : robot_(robot), times_(robot, begin), updates_(updates) {
    end_s_ = robot.process.empty() ? std::max(robot.summary.seconds, times_.end_of_data_s())
                                   : robot.process.back()[0];
  }

  // `kept_s`: time at which the first kept closure with another robot was found; the end of the run
  // if there is none.
  void join(double kept_s) {
    const bool joined = std::any_of(robot_.rounds.begin(), robot_.rounds.end(),
                                    [](const NumberRow& round) { return round[2] > 1.0; });
    if (joined) joined_s_ = std::min(kept_s, end_s_);
    round_times_s_ = times_of_rounds(robot_, joined_s_, end_s_);
  }

  [[nodiscard]] std::optional<double> seen_s(KeyframeIndex keyframe) const {
    if (keyframe >= robot_.keyframes.size()) return std::nullopt;
    return times_.run_s(robot_.keyframes[keyframe].stamp);
  }

  void add_states() {
    TrafficUntil traffic(robot_.traffic);
    std::size_t round = 0;
    for (const NumberRow& process : robot_.process) {
      const double time_s = process[0];
      traffic.advance(time_s);
      while (round < round_times_s_.size() && round_times_s_[round] <= time_s) ++round;
      ViewState state = {.name = robot_.summary.name,
                         .phase = phase_at(time_s),
                         .dataset_time_s = times_.dataset_s(time_s),
                         .keyframes = keyframes_until(time_s),
                         .anchor = anchor_at(time_s),
                         .tentative = time_s >= joined_s_ && is_tentative(),
                         .cpu_s = process[1],
                         .resident_MB = process[2] * 1e-6,
                         .links = links_of(traffic),
                         .sent_bytes = sent_by_category(traffic),
                         .loads = robot_.loads};
      if (time_s >= times_.end_of_data_s())
        state.skipped_frames = static_cast<std::uint32_t>(robot_.summary.frames_skipped);
      if (round > 0) {
        state.round = static_cast<std::uint32_t>(robot_.rounds[round - 1][1]);
        state.cost = robot_.rounds[round - 1][3];
        state.gradient_norm = robot_.rounds[round - 1][4];
      }
      add(time_s, std::move(state));
    }
  }

  void add_poses() {
    double next_s = 0.0;
    for (const StampedPose& pose : robot_.odometry) {
      const double time_s = times_.run_s(pose.stamp);
      if (time_s < next_s) continue;
      next_s = time_s + kPoseInterval_s;
      add(time_s, ViewPose{pose.stamp, pose.T});
    }
  }

  void add_keyframes() {
    for (std::size_t i = 0; i < robot_.keyframes.size(); ++i) {
      const auto pose = pose_at_keyframe(robot_.odometry, i);
      if (!pose) break;  // because the updates are numbered without gaps
      add(*seen_s(static_cast<KeyframeIndex>(i)), ViewKeyframes{false,
                                                                robot_.id,
                                                                static_cast<std::uint32_t>(i),
                                                                {*pose},
                                                                {robot_.keyframes[i].stamp}});
    }
    if (joined_s_ == kNever_s) return;
    ViewKeyframes before{true, anchor_at(joined_s_), 0, {}};
    for (std::size_t i = 0; i < robot_.keyframes.size(); ++i) {
      const auto pose = pose_at_keyframe(robot_.optimized, i);
      if (!pose) break;
      const double time_s = *seen_s(static_cast<KeyframeIndex>(i));
      before.T_world_kf.push_back(*pose);
      const bool next_is_later = i + 1 == robot_.keyframes.size() ||
                                 *seen_s(static_cast<KeyframeIndex>(i + 1)) > joined_s_;
      const bool flush = next_is_later || before.T_world_kf.size() == kMostKeyframes;
      if (!flush) continue;
      add(std::max(time_s, joined_s_), before);
      before.first = static_cast<std::uint32_t>(i + 1);
      before.T_world_kf.clear();
    }
  }

  // `seen_s`: time of any keyframe of any robot.
  void add_closures(const std::function<std::optional<double>(const KeyframeId&)>& seen_s) {
    std::map<double, ViewClosures> at;
    for (const ClosureRecord& record : robot_.closures) {
      const auto from_s = seen_s(record.id.from), to_s = seen_s(record.id.to);
      ViewClosure closure{record.id, ViewVerdict::kCandidate,
                          static_cast<std::uint16_t>(std::clamp(record.matches, 0, 65535)),
                          static_cast<std::uint16_t>(std::clamp(record.inliers, 0, 65535)),
                          record.reason};
      const double time_s = std::max(from_s.value_or(0.0), to_s.value_or(0.0));
      at[time_s].closures.push_back(closure);
      if (record.stage == ClosureStage::kCandidate) continue;
      at[time_s].closures.back().reason.clear();
      closure.verdict = verdict_of(record);
      at[time_s + kAnswer_s].closures.push_back(std::move(closure));
    }
    for (auto& [time_s, closures] : at) add_in_parts(std::min(time_s, end_s_), closures);
  }

  void add_meshes() {
    const std::size_t before = updates_.size();
    if (joined_s_ == kNever_s) {
      add_mesh(robot_.optimized_mesh.empty() ? robot_.mesh : robot_.optimized_mesh, robot_.id,
               robot_.odometry, 0.0);
      return;
    }
    add_mesh(robot_.mesh, robot_.id, robot_.odometry, 0.0);
    // After the robot has joined, no chunk remains in its own frame.
    std::vector<MeshChunk> ended;
    for (std::size_t i = before; i < updates_.size(); ++i)
      if (updates_[i].sent <= times_.stamp_at(joined_s_))
        ended.push_back({.key = std::get<MeshChunk>(updates_[i].content).key});
    updates_.erase(
        std::remove_if(
            updates_.begin() + static_cast<std::ptrdiff_t>(before), updates_.end(),
            [&](const ViewUpdate& update) { return update.sent > times_.stamp_at(joined_s_); }),
        updates_.end());
    for (MeshChunk& chunk : ended) add(joined_s_, std::move(chunk));
    add_mesh(robot_.optimized_mesh, anchor_at(joined_s_), robot_.optimized, joined_s_);
  }

 private:
  void add(double time_s, ViewContent content) {
    updates_.push_back({robot_.id, 1, times_.stamp_at(time_s), std::move(content)});
  }

  void add_in_parts(double time_s, const ViewClosures& all) {
    for (std::size_t i = 0; i < all.closures.size(); i += kMostClosures) {
      const auto begin = all.closures.begin() + static_cast<std::ptrdiff_t>(i);
      const auto count = std::min(kMostClosures, all.closures.size() - i);
      add(time_s, ViewClosures{{begin, begin + static_cast<std::ptrdiff_t>(count)}});
    }
  }

  // Each chunk appears when the robot is nearest to it, but not before `from_s`.
  void add_mesh(const LabelledMesh& mesh, RobotId anchor, const std::vector<StampedPose>& way,
                double from_s) {
    constexpr std::size_t kMostPlaces = 500;
    const std::size_t stride = way.size() / kMostPlaces + 1;
    for (MeshChunk& chunk : split_mesh(mesh, robot_.id, anchor, ChunkGrid{}).chunks) {
      Eigen::Vector3d centre = Eigen::Vector3d::Zero();
      for (const MeshChunk::Triple& offset : chunk.offsets)
        centre += Eigen::Vector3d(offset[0], offset[1], offset[2]);
      centre /= static_cast<double>(std::max<std::size_t>(chunk.offsets.size(), 1));
      centre += Eigen::Vector3d(chunk.origin[0], chunk.origin[1], chunk.origin[2]);
      centre *= static_cast<double>(chunk.step_m);
      double nearest_m = kNever_s, time_s = end_s_;
      for (std::size_t i = 0; i < way.size(); i += stride) {
        const double distance_m = (way[i].T.translation() - centre).norm();
        if (distance_m >= nearest_m) continue;
        nearest_m = distance_m;
        time_s = times_.run_s(way[i].stamp);
      }
      add(std::max(time_s, from_s), std::move(chunk));
    }
  }

  static ViewVerdict verdict_of(const ClosureRecord& record) {
    if (record.stage == ClosureStage::kInlier) return ViewVerdict::kKept;
    if (record.stage == ClosureStage::kRequested) return ViewVerdict::kCandidate;
    if (!record.reason.empty()) return ViewVerdict::kRejected;
    return record.stage == ClosureStage::kVerified ? ViewVerdict::kVerified
                                                   : ViewVerdict::kCandidate;
  }

  std::optional<SE3> pose_at_keyframe(const std::vector<StampedPose>& poses, std::size_t i) const {
    return pose_at(poses, robot_.keyframes[i].stamp, kMaxPoseGap_s, kMaxPoseGap_s);
  }

  bool is_tentative() const {
    const OptimizerSummary& pgo = robot_.summary.pgo;
    return pgo.anchor && std::ranges::binary_search(pgo.tentative, *pgo.anchor);
  }

  RobotId anchor_at(double time_s) const {
    return time_s < joined_s_ ? robot_.id : robot_.summary.pgo.anchor.value_or(robot_.id);
  }

  std::string phase_at(double time_s) const {
    if (time_s < times_.end_of_data_s()) return "running";
    return time_s >= end_s_ && robot_.summary.pgo.settled ? "settled" : "finished";
  }

  std::uint32_t keyframes_until(double time_s) const {
    std::uint32_t count = 0;
    while (count < robot_.keyframes.size() && *seen_s(count) <= time_s) ++count;
    return count;
  }

  const RobotFiles& robot_;
  RobotTimes times_;
  std::vector<ViewUpdate>& updates_;
  double end_s_ = 0.0;
  // Time of its first kept closure with another robot; infinite without rounds with others.
  double joined_s_ = kNever_s;
  std::vector<double> round_times_s_;
};

// Folders of robots that have ended; `notes` list the others. Throws if there are none.
std::vector<fs::path> ended_runs(const fs::path& folder, std::vector<std::string>& notes) {
  if (is_file(folder))
    throw std::runtime_error(
        folder.string() +
        ": a file, not the folder of a run; Foxglove and kimera_multi_evaluate "
        "open records (.mcap)");
  if (!is_folder(folder)) throw std::runtime_error(folder.string() + ": no such folder");
  std::vector<fs::path> folders = robot_folders(folder);
  std::erase_if(folders, [&notes](const fs::path& one) {
    if (is_file(one / kSummary)) return false;
    notes.push_back(unfinished(one) + "; " + way_on(one));
    return true;
  });
  if (folders.empty())
    throw std::runtime_error(notes.empty()
                                 ? folder.string() +
                                       ": no results in it: no summary.json, nor folders that have "
                                       "one; give the --output of kimera_multi_team or of a robot"
                                 : notes.front());
  return folders;
}

LabelPalette palette_in(const fs::path& folder, std::vector<std::string>& notes) try {
  const fs::path file = folder / kLabelPalette;
  return is_there(file) ? parse_label_palette(read_input_file(file), file.string())
                        : LabelPalette{};
} catch (const std::exception& error) {
  notes.emplace_back(error.what());
  return {};
}

}  // namespace

RunPlayback read_run(const fs::path& folder, Stamp begin) {
  RunPlayback run;
  std::vector<RobotFiles> robots;
  for (const fs::path& one : ended_runs(folder, run.notes)) {
    robots.push_back(read_robot(one, run.notes));
    if (run.palette.classes().empty()) run.palette = palette_in(one, run.notes);
  }
  std::map<RobotId, RobotPlayback> playbacks;
  for (const RobotFiles& robot : robots)
    if (!playbacks.try_emplace(robot.id, robot, begin, run.updates).second)
      throw std::runtime_error(folder.string() + ": two folders are of robot " +
                               std::to_string(robot.id) + ": give one run");
  const auto seen_s = [&](const KeyframeId& id) -> std::optional<double> {
    const auto robot = playbacks.find(id.robot);
    return robot != playbacks.end() ? robot->second.seen_s(id.index) : std::nullopt;
  };
  std::map<RobotId, double> kept_s;
  for (const RobotFiles& robot : robots)
    for (const ClosureRecord& record : robot.closures) {
      if (record.stage != ClosureStage::kInlier || record.id.from.robot == record.id.to.robot)
        continue;
      const double time_s = kAnswer_s + std::max(seen_s(record.id.from).value_or(0.0),
                                                 seen_s(record.id.to).value_or(0.0));
      for (const RobotId id : {record.id.from.robot, record.id.to.robot}) {
        const auto known = kept_s.try_emplace(id, time_s).first;
        known->second = std::min(known->second, time_s);
      }
    }
  for (auto& [id, robot] : playbacks) {
    robot.join(kept_s.contains(id) ? kept_s.at(id) : kNever_s);
    robot.add_states();
    robot.add_poses();
    robot.add_keyframes();
    robot.add_closures(seen_s);
    robot.add_meshes();
  }
  std::stable_sort(run.updates.begin(), run.updates.end(),
                   [](const ViewUpdate& a, const ViewUpdate& b) { return a.sent < b.sent; });
  return run;
}

}  // namespace km
