#include "apps/robot/failed_odometry.hpp"

#include <algorithm>
#include <memory>
#include <variant>

#include "apps/robot/robot_input.hpp"
#include "modules/diagnosis/examine_sensors.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

std::vector<Finding> causes_of_failed_odometry(const RobotOptions& options,
                                               const RobotConfig& config,
                                               SignalWatch& signals) try {
  constexpr double kLook_s = 30.0;
  if (options.is_live || options.dataset.empty()) return {};
  RobotOptions part;
  part.dataset = options.dataset;
  part.rig = options.rig;
  part.from_s = options.from_s;
  part.to_s = std::min(options.from_s.value_or(0.0) + kLook_s, options.to_s.value_or(1e9));
  const auto input = open_robot_input(part, config, std::nullopt, read_rig_input(part), signals);
  if (!input) return {};
  DatasetReader& reader = *std::get<std::unique_ptr<DatasetReader>>(input->source);
  SensorSampler sampler;
  while (const auto packet = reader.next()) sampler.add(*packet);
  const SensorSample& sample = sampler.sample();
  const StereoRig& rig = reader.rig().stereo;
  Examination result = examine_images(sample);
  result.add(examine_stereo(sample, rig));
  result.add(examine_depth(sample, rig));
  result.add(examine_inertial(sample, rig));
  std::erase_if(result.findings, [](const Finding& f) { return f.severity == Severity::kNote; });
  return result.findings;
} catch (const std::runtime_error&) {  // a fault of the recording, which the run has reported
  return {};
}

}  // namespace km
