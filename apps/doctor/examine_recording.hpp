#pragma once

#include <functional>
#include <string_view>

#include "apps/robot/robot_config.hpp"
#include "modules/diagnosis/examination.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// Called with the finished share of the work, 0 to 1; always 0 if the share is unknown.
using ReportProgress = std::function<void(std::string_view stage, double share)>;

/// Findings on a recording, or on the live sensors of a rig file: see examine_sensors.hpp.
/// `options` names the input and the window, as for a robot. Live sensors are examined for
/// `live_s`. An input that cannot be opened is the finding recording.refused. The vocabulary of
/// `config` is also compared with the images (vocabulary.coverage).
[[nodiscard]] Examination examine_recording(const RobotOptions& options, const RobotConfig& config,
                                            double live_s, const ReportProgress& report_progress);

/// Findings on the packets of a reader: for `live_s` if it is above 0, otherwise up to the end.
[[nodiscard]] Examination examine_packets(DatasetReader& reader, const RobotConfig& config,
                                          double live_s, const ReportProgress& report_progress);

}  // namespace km
