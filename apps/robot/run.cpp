#include "apps/robot/run.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <variant>

#include "apps/output_file.hpp"
#include "apps/program_version.hpp"
#include "apps/result_files.hpp"
#include "apps/result_writer.hpp"
#include "apps/robot/assemblies/robot.hpp"
#include "apps/robot/conclusion.hpp"
#include "apps/robot/final_room.hpp"
#include "apps/robot/watch.hpp"
#include "modules/core/io/write_file.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "runtime/log.hpp"
#include "runtime/thread.hpp"
#include "runtime/unblocked_output.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

bool is_fault_of_disk(const std::error_code& error) {
  return error == std::errc::no_space_on_device || error == std::errc::io_error;
}

// Changes the results folder before the run. If the disk fails, the loss is noted and the robot
// runs without it. Throws std::runtime_error for a folder that cannot be used or is read-only.
void change_output(const RobotOptions& options, ResultWriter& results,
                   const std::function<void(const fs::path&)>& change) try {
  change(options.output);
} catch (const fs::filesystem_error& error) {
  if (!is_fault_of_disk(error.code()))
    throw std::runtime_error(options.output.string() + ": cannot be written to: " +
                             error.code().message() + "; choose another folder for the results");
  results.note(options.output, error.code().message());
}

void make_output(const fs::path& folder) {
  fs::create_directories(folder);
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw fs::filesystem_error("", std::error_code(errno, std::generic_category()));
}

// Call when all inputs of the run have been checked, because earlier results are removed.
void remove_former(const fs::path& folder, bool continues, bool resume) {
  if (!resume && is_file(folder / kSummary))
    log::warn("robot") << folder.string() << ": the results of an earlier run are replaced";
  remove_results(folder, continues);
  if (resume) return;
  for (const char* file : {kJournal, kMapFile}) fs::remove(folder / file);
}

// The journal and the map of the run to extend, if this process begins to do so, as the beginning
// of this run.
void copy_extended(const RobotOptions& options) {
  if (options.extend.empty() || options.resume) return;
  for (const char* file : {kJournal, kMapFile})
    if (is_file(options.extend / file)) fs::copy_file(options.extend / file, options.output / file);
}

void log_network(const RobotConfig& config, const NetworkInterface& interface) {
  const char* const discovery =
      config.dds.discovery == Discovery::kMulticast ? "multicast" : "address";
  log::info("dds") << "domain " << config.dds.domain << " on " << interface.name << " ("
                   << interface.address << "), link " << config.run.link
                   << ", datagrams of at most " << largest_datagram(config.dds, interface)
                   << " B, peers by " << discovery;
}

// The estimate is relative to the rig with which the run began. A EuRoC folder keeps its own
// calibration.
void write_estimated_rig(const RobotOptions& options, const RigInput& rig, const RunRecord& record,
                         ResultWriter& results) {
  const std::optional<UncertainCalibration> found = record.calibration();
  if (!found) return;
  const CameraCalibration correction = found->calibration.composed_with(rig.correction);
  results.write(options.output / kEstimatedRig, [&](const auto& file) {
    write_file(file,
               "# Stamps and mounting of the cameras as vio.calibrate found them: for --rig\n" +
                   corrected_rig_text(rig.messages ? options.rig : "", correction));
  });
}

// The other robots of a recorded graph.
std::set<RobotId> partners_in(const RobotInput& input, RobotId self) {
  std::set<RobotId> partners;
  if (const auto* graph = std::get_if<RecordedGraph>(&input.source))
    for (const RelativePose& closure : graph->inter_closures)
      partners.insert(closure.from.robot == self ? closure.to.robot : closure.from.robot);
  return partners;
}

// Path of the MCAP record, if one is requested; a resumed run writes a new file. Throws
// std::runtime_error if the folder of the requested file does not exist.
std::optional<fs::path> record_file(const RobotOptions& options, bool continues) {
  if (!options.record) return std::nullopt;
  const bool is_named = !options.record->empty();
  if (is_named) check_output_folder(*options.record);
  const fs::path file = is_named ? *options.record : options.output / kRecord;
  if (!continues || !fs::exists(file)) return file;
  int number = 2;
  while (fs::exists(numbered(file, number))) ++number;
  return numbered(file, number);
}

std::optional<ImageSources> sources_of(const RobotOptions& options,
                                       const std::optional<PartialRig>& rig) {
  if (rig) return image_sources(rig->rig.topics, options.rig);
  if (options.dataset.empty()) return std::nullopt;
  return image_sources(options.dataset);
}

}  // namespace

int run_robot(const RobotOptions& asked, SignalWatch& signals,
              const std::function<void(Topics&)>& listen) {
  RobotOptions options = asked;
  const RobotConfig config = load_robot_config(options);
  const RigInput rig = read_rig_input(options);
  std::optional<MappingPlan> mapping = plan_mapping(
      config.mapping, config.stereo_depth, config.segmentation, sources_of(options, rig.messages));
  if (mapping && mapping->reads_depth()) mapping->depth_baseline_m = depth_baseline_m(options);
  std::optional<RobotInput> input = open_robot_input(options, config, mapping, rig, signals);
  if (!input) {
    log::info("robot") << "interrupted before the calibration was complete: no results";
    return 0;
  }
  ResultWriter results;
  change_output(options, results, make_output);
  log::info("robot") << "kimera_multi_robot " << built_version() << ", commit " << built_commit();
  has_urgent_work = options.is_live || !options.pace.waits;
  const bool continues =
      options.resume && input->restored_from == RestoredFrom::kFormerProcess && input->restored;
  options.record = record_file(options, continues);
  std::set<RobotId> partners = partners_in(*input, options.robot);
  Robot robot(options, config, *std::move(input), mapping, results, signals);
  if (listen) listen(robot.topics());
  log_network(config, robot.interface());
  if (mapping && mapping->sensor.labels == LabelsFrom::kImages &&
      !config.segmentation.palette.empty())
    log::warn("robot") << "segmentation.palette is not used: labels are recorded, and with them "
                          "their label_palette.csv";
  change_output(options, results, [&](const fs::path& folder) {
    remove_former(folder, continues, options.resume);
    copy_extended(options);
  });
  const auto write = [&](const char* name, const std::string& text) {
    results.write(options.output / name, [&text](const auto& file) { write_file(file, text); });
  };
  const auto write_settings = [&] {
    write("config.yaml", config.effective);
    if (mapping && !mapping->palette.classes().empty())
      write(kLabelPalette, to_csv(mapping->palette));
  };
  write_settings();
  FinalRoom room(options.output,
                 robot.sensing().sensors() != nullptr ? robot.sensing().sensors()->listed() : 0);

  std::optional<Watch> watch;
  watch.emplace(options, config, continues, std::move(partners), robot, results);
  const RunResult result = robot.run([&] {
    std::size_t images = 0, keyframes = 0;
    (void)robot.records().recorder().try_with_record([&](const RunRecord& record) {
      images = record.odometry().size();
      keyframes = record.keyframes().size();
    });
    room.grow(images, keyframes);  // not under the lock of the record: the disk may stall
    return watch->poll();
  });
  const auto end = [&](const RunRecord& record) {
    if (!fs::exists(options.output / "config.yaml")) write_settings();  // deleted during the run
    write_estimated_rig(options, rig, record, results);
    return conclude({options, config, robot, result, record}, watch, room, results, signals);
  };
  if (result.is_left_behind("recorder"))
    results.note(options.output, "what was recorded is lost with the recorder, which hangs");
  const int exit_code = result.is_left_behind("recorder")
                            ? end(RunRecord(options.robot))
                            : robot.records().recorder().with_record(end);
  if (result.left_behind.empty()) return exit_code;
  // Hung threads use objects that a return would destroy. The process therefore ends here, after
  // the robot has left the network.
  if (!result.is_left_behind(robot.bridge().name())) robot.leave();
  drain_standard_output();
  std::_Exit(exit_code);
}

}  // namespace km
