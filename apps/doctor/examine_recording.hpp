#pragma once

#include <functional>
#include <string_view>

#include "apps/robot/robot_config.hpp"
#include "modules/diagnosis/examination.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// Told how far the work is, 0 to 1; 0 throughout where that is not known.
using TellProgress = std::function<void(std::string_view stage, double share)>;

/// What a recording, or the live sensors of a rig file, show, and what of it stands out: see
/// examine_sensors.hpp. `options` names the input as for a robot, with the window. Of live sensors
/// `live_s` are looked at. What cannot be opened is a finding, too: recording.refused. The
/// vocabulary of `config` is held against the images: vocabulary.coverage.
[[nodiscard]] Examination examine_recording(const RobotOptions& options, const RobotConfig& config,
                                            double live_s, const TellProgress& tell);

/// Likewise, of a reader, up to its end; with `live_s` above 0 up to then.
[[nodiscard]] Examination examine_packets(DatasetReader& reader, const RobotConfig& config,
                                          double live_s, const TellProgress& tell);

}  // namespace km
