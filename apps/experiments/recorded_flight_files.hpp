#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace km {

/// What there is of one of EuRoC's recordings.
struct RecordedFlightFiles {
  std::filesystem::path folder;  ///< ASL folder with images of both cameras; or empty.
  std::filesystem::path truth;   ///< True poses (CSV or TUM, perhaps gzipped); or empty.
  std::filesystem::path imu;     ///< Inertial data; or empty.
};

/// Looks below `place` for the recording `name`: for an ASL folder whose name begins with it
/// (V1_01_easy, with mav0 in it), and for files NAME*.csv or NAME*.txt, perhaps with .gz, of true
/// poses or, with "imu" in their name, of inertial data. Of an ASL folder the images count as there
/// if those of the left camera span at least `least_s` (an excerpt is not the flight). At most
/// three levels deep; of several the first by name counts.
[[nodiscard]] RecordedFlightFiles find_recorded_flight(const std::filesystem::path& place,
                                                       const std::string& name,
                                                       double least_s = 30.0);

}  // namespace km
