#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/security/team_folder.hpp"
#include "runtime/clock.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/process.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {

/// Starts test_dds_peer as robot `id` with the settings of the section dds. `keys` is its folder of
/// keys; empty: the team has none.
inline std::unique_ptr<Process> start_peer(RobotId id, const std::vector<std::string>& settings,
                                           pid_t network_of = 0,
                                           const std::filesystem::path& keys = {}) {
  std::vector<std::string> command{KM_BIN_DIR "/test_dds_peer", std::to_string(id), keys.string()};
  for (const std::string& setting : settings) command.push_back("dds." + setting);
  return std::make_unique<Process>(command, network_of);
}

/// A team's keys for the robots 3 and 4.
class TeamOfTwo {
 public:
  TeamOfTwo() {
    const auto now_s = static_cast<std::int64_t>(wall_now_s());
    TeamFolder::make(team(), {{3, robot_name(3)}, {4, robot_name(4)}}, now_s, now_s + 86400);
  }
  [[nodiscard]] std::filesystem::path of(RobotId robot) const { return team() / robot_name(robot); }

 private:
  [[nodiscard]] std::filesystem::path team() const { return folder_.path() / "team"; }

  TemporaryFolder folder_;
};

/// Domain and team of this test alone.
inline std::vector<std::string> own_team() {
  const DdsConfig config = loopback_config();
  return {"domain=" + std::to_string(config.domain), "team=" + config.team};
}

inline double seconds_between(std::chrono::steady_clock::time_point a,
                              std::chrono::steady_clock::time_point b) {
  return std::chrono::duration<double>(b - a).count();
}

inline std::vector<std::string> operator+(std::vector<std::string> a,
                                          const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace km
