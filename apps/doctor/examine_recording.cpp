#include "apps/doctor/examine_recording.hpp"

#include <atomic>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <variant>

#include "apps/robot/robot_input.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/text_table.hpp"
#include "modules/diagnosis/examine_sensors.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

Examination refused(const std::string& why) {
  return {
      .figures = {},
      .findings = {
          {.id = "recording.refused",
           .severity = Severity::kError,
           .what = why,
           .means = "no robot can play this input",
           .to_do = "correct the stated fault; kimera_multi_robot --inspect lists the contents"}}};
}

// Stops a live reader after some seconds, also while the reader waits for silent sensors.
class Stopper {
 public:
  Stopper(DatasetReader& reader, double seconds)
      : thread_([this, &reader, seconds](const std::stop_token& stop) {
          std::unique_lock lock(mutex_);
          ended_.wait_for(lock, stop, steady_duration(seconds), [] { return false; });
          reader.stop();
        }) {}

 private:
  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::jthread thread_;  // last member: stops first
};

SensorSample sample_of(DatasetReader& reader, double live_s,
                       const ReportProgress& report_progress) {
  std::optional<Stopper> stopper;
  if (live_s > 0.0) stopper.emplace(reader, live_s);
  SensorSampler sampler;
  const auto total = static_cast<double>(reader.pair_count());
  for (double done = 0.0; const auto packet = reader.next(); ++done) {
    report_progress("looking at images", total > 0.0 ? done / total : 0.0);
    sampler.add(*packet);
  }
  return sampler.sample();
}

}  // namespace

Examination examine_packets(DatasetReader& reader, const RobotConfig& config, double live_s,
                            const ReportProgress& report_progress) {
  const SensorSample sample = sample_of(reader, live_s, report_progress);
  report_progress("comparing", 0.0);
  Examination result = examine_streams(sample, reader.report());
  for (const std::string& remark : reader.remarks())
    result.findings.push_back({.id = "recording.remark",
                               .severity = Severity::kNote,
                               .what = remark,
                               .means = "the reader takes this into account"});
  if (sample.frames.empty()) return result;
  const StereoRig& rig = reader.rig().stereo;
  result.add(examine_images(sample));
  result.add(examine_stereo(sample, rig));
  result.add(examine_inertial(sample, rig));
  result.add(examine_words(sample.descriptors, load_vocabulary(find_shipped_file(
                                                   config.run.vocabulary, "run.vocabulary"))));
  sort_by_severity(result.findings);
  return result;
}

Examination examine_recording(const RobotOptions& options, const RobotConfig& config, double live_s,
                              const ReportProgress& report_progress) try {
  const auto input = [&] {
    SignalWatch signals;  // interrupts the wait for a live calibration
    return open_robot_input(options, config, std::nullopt, read_rig_input(options), signals);
  }();
  if (!input) return refused("interrupted before the calibration was complete");
  return examine_packets(*std::get<std::unique_ptr<DatasetReader>>(input->source), config,
                         options.is_live ? live_s : 0.0, report_progress);
} catch (const DatasetError& error) {
  return refused(error.what());
} catch (const ConfigError& error) {
  return refused(error.what());
} catch (const InputFileError& error) {
  return refused(error.what());
}

}  // namespace km
