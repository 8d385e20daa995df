#include "odometry_run.hpp"

#include <ctime>
#include <map>

namespace km {
namespace {

double thread_cpu_ms() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

}  // namespace

OdometryRun run_odometry(const Recording& recording, std::size_t first, std::size_t last,
                         const TrackerConfig& tracker, const VioConfig& config) {
  Vio vio(0, recording.rig, tracker, config);
  OdometryRun run;
  std::map<Stamp, const SE3*> truth;
  for (std::size_t k = first; k < last; ++k) {
    truth[recording.packets[k].frame->stamp] = &recording.T_world_body[k];
    const double begin = thread_cpu_ms();
    VioResult result = vio.process(recording.packets[k]);
    run.cpu_ms.push_back(thread_cpu_ms() - begin);
    for (const OdometryState& state : result.states) {
      run.states.push_back(state);
      run.truth.push_back(*truth.at(state.stamp));
    }
    run.keyframes.insert(run.keyframes.end(), result.keyframes.begin(), result.keyframes.end());
    run.results.push_back(std::move(result));
  }
  run.statistics = vio.statistics();
  return run;
}

}  // namespace km
