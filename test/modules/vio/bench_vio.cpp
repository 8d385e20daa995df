// Odometry on EuRoC MH_01_easy as in the table of results: three pieces and 21 starts.
//   bench_vio DATASET [images] [rgbd] [starts] [black] [resume=SECONDS] [rest=SECONDS]
//   [flight=SECONDS]
//             [late=MILLISECONDS] [turned=DEGREES] [KEY=VALUE ...]
// KEY is a key of the sections vio and tracker.
//
// "images" leaves the inertial sensor out. "rgbd" replaces the right images by depth computed from
// both, and "starts" adds the 21 starts. "black" runs with one second of black images at each of 12
// positions. "resume" ends odometry within the first seconds at every keyframe, once or at every
// n-th, and resumes it there, with the state and without it. "rest" stands still for that time;
// DATASET is V1_01_easy then. "flight" runs once over the first seconds of a recording. "late"
// delays the stamps of inertial samples, and "turned" rotates the cameras against the rig's
// calibration.

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <map>
#include <numbers>
#include <sstream>
#include <string>

#include "modules/core/lie.hpp"
#include "modules/evaluation/statistics.hpp"
#include "recorded_odometry.hpp"

namespace km {
namespace {

// Sets fields by name from the command line.
struct Overrides {
  std::map<std::string, std::string> values;
  std::map<std::string, bool> used;

  template <typename T>
  requires std::is_arithmetic_v<T>
  void field(const char* name, T& value, const Bounds<std::type_identity_t<T>>& /*bounds*/,
             const char* /*comment*/ = "") {
    const auto it = values.find(name);
    if (it == values.end()) return;
    std::istringstream(it->second) >> value;
    used[name] = true;
  }
  void field(const char* name, bool& value, const char* /*comment*/) {
    field(name, value, Bounds<bool>{});
  }
};

OdometryErrors errors_since(const OdometryRun& run, double seconds) {
  std::size_t first = 0;
  while (first < run.states.size() &&
         seconds_between(run.states.front().stamp, run.states[first].stamp) < seconds)
    ++first;
  return odometry_errors(std::span(run.states).subspan(first), std::span(run.truth).subspan(first));
}

std::size_t packet_at(const Recording& recording, double seconds) {
  std::size_t k = 0;
  const Stamp start = recording.packets.front().frame->stamp;
  while (k < recording.packets.size() &&
         seconds_between(start, recording.packets[k].frame->stamp) < seconds - 1e-3)
    ++k;
  return k;
}

// Squared Mahalanobis distance of `steps` consecutive keyframe steps (6 on average if the
// covariances are right) and the share inside their 95 % bound.
void print_consistency(const OdometryRun& run, std::size_t steps) {
  std::map<Stamp, const SE3*> truth;
  for (std::size_t k = 0; k < run.states.size(); ++k) truth[run.states[k].stamp] = &run.truth[k];
  double inside = 0.0, mean = 0.0, n = 0.0, rotation = 0.0, translation = 0.0;
  for (std::size_t k = steps; k < run.keyframes.size(); ++k) {
    const SE3 T =
        truth.at(run.keyframes[k - steps].stamp)->inverse() * *truth.at(run.keyframes[k].stamp);
    UncertainPose estimate;
    for (std::size_t i = k - steps + 1; i <= k; ++i)
      estimate = compose(estimate, {run.keyframes[i].T_previous_kf, run.keyframes[i].covariance});
    const Vector6 e = se3_log(estimate.T.inverse() * T);
    const Matrix6& S = estimate.Sigma;
    const double d = e.dot(S.ldlt().solve(e));
    rotation += e.head<3>().dot(S.topLeftCorner<3, 3>().ldlt().solve(e.head<3>()));
    translation += e.tail<3>().dot(S.bottomRightCorner<3, 3>().ldlt().solve(e.tail<3>()));
    inside += d < 12.592;  // chi-squared, 6 degrees of freedom, 95 %
    mean += d;
    n += 1.0;
  }
  std::printf(
      "    keyframes %zu, over %zu: chi2 mean %.2f (rotation %.2f, translation %.2f), inside 95%%: "
      "%.0f%%\n",
      run.keyframes.size(), steps, mean / n, rotation / n, translation / n, 100.0 * inside / n);
}

void print_piece(const char* name, const OdometryRun& run, std::size_t images) {
  if (run.states.size() < 3) {
    std::printf("%s: no poses\n", name);
    return;
  }
  const OdometryErrors all = errors_since(run, 0.0), late = errors_since(run, 2.4);
  std::vector<double> cpu;
  std::vector<double> iterations, landmarks;
  int keyframes = 0;
  for (std::size_t k = 0; k < run.results.size(); ++k) {
    if (!run.results[k].smoother) continue;
    cpu.push_back(run.cpu_ms[k]);
    iterations.push_back(run.results[k].smoother->solution.iterations);
    landmarks.push_back(run.results[k].smoother->landmarks);
    keyframes += run.results[k].smoother->keyframe;
  }
  std::printf(
      "%s %4zu/%zu  ATE %6.2f mm max %6.2f  RPE %5.2f mm %5.3f deg  tilt %4.2f  scale %.3f  "
      "| +2.4s ATE %5.2f RPE %5.2f %5.3f tilt %4.2f | cpu %.2f/%.2f/%.2f ms %s | it %.0f lm %.0f "
      "kf "
      "%d restarts %d\n",
      name, run.states.size(), images, 1e3 * all.ate_m, 1e3 * all.max_m, 1e3 * all.rpe_m,
      all.rpe_deg, all.tilt_deg, all.scale, 1e3 * late.ate_m, 1e3 * late.rpe_m, late.rpe_deg,
      late.tilt_deg, quantile(cpu, 0.5), quantile(cpu, 0.95), quantile(run.cpu_ms, 1.0),
      run.kernel_share.c_str(), quantile(iterations, 0.5), quantile(landmarks, 0.5), keyframes,
      run.statistics.starts - 1);
}

// How often points and images contradict the estimate, see EstimateWatch.
void print_fit(const OdometryRun& run) {
  EstimateWatch watch, image;
  double points = 0.0, contradicting = 0.0, judged = 0.0, images = 0.0, most = 0.0;
  std::vector<double> factors;
  for (const VioResult& result : run.results) {
    if (!result.smoother) continue;
    const ImageFit& fit = result.smoother->fit;
    if (fit.points < EstimateWatch::kMinPoints) continue;
    points += fit.points;
    contradicting += fit.contradicting;
    judged += 1.0;
    images += fit.contradicting > EstimateWatch::kContradictingShare * fit.points;
    watch.add(fit);
    most = std::max(most, watch.evidence());
    if (watch.is_contradicted()) watch = {};
    image = {};
    image.add(fit);
    factors.push_back(image.variance_factor());
  }
  std::printf(
      "    contradicting: %.2f %% of %.0f points, %.2f %% of %.0f images, evidence at most %.1f; "
      "variance factor median %.2f p95 %.2f max %.2f; %d contradictions\n",
      100.0 * contradicting / points, points, 100.0 * images / judged, judged, most,
      quantile(factors, 0.5), quantile(factors, 0.95), quantile(factors, 1.0),
      run.statistics.contradictions);
}

// Error of the last pose relative to the first one, as a share of the path.
void print_drift(const OdometryRun& run) {
  double path_m = 0.0;
  for (std::size_t k = 1; k < run.truth.size(); ++k)
    path_m += (run.truth[k].translation() - run.truth[k - 1].translation()).norm();
  const SE3 T = run.states.front().T_odom_body.inverse() * run.states.back().T_odom_body;
  const SE3 error = T.inverse() * run.truth.front().inverse() * run.truth.back();
  std::printf("    drift %.3f %% of %.1f m, %.3f deg\n",
              100.0 * error.translation().norm() / path_m, path_m,
              angle_of(error.linear()) * 180.0 / std::numbers::pi);
}

void run_black(const Recording& recording, const TrackerConfig& tracker, const VioConfig& config) {
  for (double from = 1.5; from < 13.0; from += 1.0) {
    const Recording black =
        darkened(recording, packet_at(recording, from), packet_at(recording, from + 1.0));
    const OdometryRun run = run_odometry(black, 0, packet_at(black, 15.0), tracker, config);
    const OdometryErrors errors = errors_since(run, 0.0);
    std::printf(
        "black %4.1f-%4.1f: %zu poses, %d starts, %d divergences, ATE %.1f mm, max %.1f mm, %.3f "
        "deg\n",
        from, from + 1.0, run.states.size(), run.statistics.starts, run.statistics.divergences,
        1e3 * errors.ate_m, 1e3 * errors.max_m, errors.rpe_deg);
  }
}

// Errors of odometry that ends at the `keyframes`-th new keyframe of each of its first `kills`
// processes and is resumed there. The first process is the beginning of `whole`.
OdometryErrors killed_errors(const Recording& recording, const OdometryRun& whole,
                             std::size_t keyframes, std::size_t kills, bool from_state,
                             const TrackerConfig& tracker, const VioConfig& config) {
  OdometryRun joined, run = whole;
  std::size_t first = 0;
  for (std::size_t run_index = 0;; ++run_index) {
    const bool killed = run_index < kills && run.keyframes.size() > keyframes;
    for (std::size_t k = 0; k < run.states.size(); ++k) {
      if (killed && run.states[k].stamp > run.keyframes[keyframes - 1].stamp) break;
      joined.states.push_back(run.states[k]);
      joined.truth.push_back(run.truth[k]);
    }
    if (!killed) return errors_since(joined, 0.0);
    VioCheckpoint checkpoint{joined.states.back(), run.keyframes[keyframes - 1]};
    if (!from_state) checkpoint.keyframe.state_covariance.reset();
    while (recording.packets[first].frame->stamp < checkpoint.keyframe.stamp) ++first;
    run = run_odometry(recording, first, recording.packets.size(), tracker, config, checkpoint);
  }
}

void run_resume(const Recording& recording, const TrackerConfig& tracker, const VioConfig& config) {
  const OdometryRun whole = run_odometry(recording, 0, recording.packets.size(), tracker, config);
  const double whole_mm = 1e3 * errors_since(whole, 0.0).ate_m;
  std::printf("never killed: ATE %.2f mm, %zu keyframes\n", whole_mm, whole.keyframes.size());
  std::array<std::vector<double>, 2> all;
  const auto compare = [&](std::size_t keyframes, std::size_t kills) {
    std::array<double, 2> ate_mm;
    for (const std::size_t from_state : {0U, 1U})
      ate_mm[from_state] =
          1e3 *
          killed_errors(recording, whole, keyframes, kills, from_state == 1, tracker, config).ate_m;
    return ate_mm;
  };
  for (std::size_t k = 1; k < whole.keyframes.size(); ++k) {
    const auto [anew, on] = compare(k, 1);
    all[0].push_back(anew);
    all[1].push_back(on);
    const Stamp stamp = whole.keyframes[k - 1].stamp;
    std::printf("killed at %5.2f s: ATE %6.2f mm from scratch, %6.2f mm from its state\n",
                seconds_between(whole.states.front().stamp, stamp), anew, on);
  }
  for (const std::size_t from_state : {0U, 1U}) {
    const std::vector<double>& mm = all[from_state];
    std::printf("%s: ATE median %.2f p90 %.2f max %.2f mm, more than 5 %% worse %zu of %zu\n",
                from_state == 1 ? "from its state" : "from scratch", quantile(mm, 0.5),
                quantile(mm, 0.9), quantile(mm, 1.0),
                static_cast<std::size_t>(
                    std::ranges::count_if(mm, [&](double v) { return v > 1.05 * whole_mm; })),
                mm.size());
  }
  for (const std::size_t keyframes : {2U, 3U, 5U, 8U}) {
    const auto [anew, on] = compare(keyframes, whole.keyframes.size());
    std::printf(
        "killed at every %zu keyframes: ATE %6.2f mm from scratch, %6.2f mm from its state\n",
        keyframes, anew, on);
  }
}

void run_rest(const Recording& standing, const TrackerConfig& tracker, const VioConfig& config) {
  const OdometryRun run = run_odometry(standing, 0, standing.packets.size(), tracker, config);
  const SE3 first = run.states.front().T_odom_body, last = run.states.back().T_odom_body;
  double most_m = 0.0, most_rad = 0.0;
  for (const OdometryState& state : run.states) {
    const SE3 T = first.inverse() * state.T_odom_body;
    most_m = std::max(most_m, T.translation().norm());
    most_rad = std::max(most_rad, angle_of(T.linear()));
  }
  const SE3 drift = first.inverse() * last;
  std::printf(
      "%.0f s at rest: %zu keyframes, %d rests, moved by %.2f mm, %.3f deg in the end, at most "
      "%.2f mm, %.3f deg; cpu %.2f ms\n",
      seconds_between(run.states.front().stamp, run.states.back().stamp), run.keyframes.size(),
      run.statistics.rests, 1e3 * drift.translation().norm(),
      angle_of(drift.linear()) * 180.0 / std::numbers::pi, 1e3 * most_m,
      most_rad * 180.0 / std::numbers::pi, quantile(run.cpu_ms, 0.5));
}

int run(int argc, char** argv) {
  bool starts = false, black = false, rgbd = false, imu = true;
  double resume_s = 0.0, rest_s = 0.0, flight_s = 0.0, late_ms = 0.0, turned_deg = 0.0;
  const std::map<std::string, double*> numbers = {{"resume", &resume_s},
                                                  {"rest", &rest_s},
                                                  {"flight", &flight_s},
                                                  {"late", &late_ms},
                                                  {"turned", &turned_deg}};
  Overrides overrides;
  for (int a = 2; a < argc; ++a) {
    const char* equals = std::strchr(argv[a], '=');
    const std::string name(argv[a], equals == nullptr ? std::strlen(argv[a])
                                                      : static_cast<std::size_t>(equals - argv[a]));
    if (equals != nullptr && numbers.contains(name))
      *numbers.at(name) = std::atof(equals + 1);
    else if (equals != nullptr)
      overrides.values[name] = equals + 1;
    else if (std::strcmp(argv[a], "rgbd") == 0)
      rgbd = true;
    else if (std::strcmp(argv[a], "images") == 0)
      imu = false;
    else
      (std::strcmp(argv[a], "starts") == 0 ? starts : black) = true;
  }
  TrackerConfig tracker;
  VioConfig config;
  tracker.visit_fields(overrides);
  config.visit_fields(overrides);
  for (const auto& [name, value] : overrides.values)
    if (!overrides.used[name]) throw std::invalid_argument("unknown key " + name);

  if (rest_s > 0.0) {
    run_rest(standing_recording(argv[1], rest_s), tracker, config);
    return 0;
  }
  if (resume_s > 0.0) {
    run_resume(read_recording(argv[1], 0.0, resume_s), tracker, config);
    return 0;
  }
  const auto read = [&](double to_s) {
    return disturbed(read_recording(argv[1], 0.0, to_s, imu), 1e-3 * late_ms,
                     turned_deg * std::numbers::pi / 180.0);
  };
  if (flight_s > 0.0) {
    const Recording flight = read(flight_s);
    const std::size_t images = flight.packets.size();
    const OdometryRun run = run_odometry(flight, 0, images, tracker, config);
    print_piece("flight", run, images);
    print_drift(run);
    print_fit(run);
    for (const std::size_t steps : {1U, 3U, 8U}) print_consistency(run, steps);
    return 0;
  }
  Recording recording = read(16.0);
  if (rgbd) recording = as_rgbd(recording);
  const struct {
    const char* name;
    double from, to;
  } pieces[] = {{"a  0.0- 7.5", 0.0, 7.5}, {"b  7.5-15.0", 7.5, 15.0}, {"c  0.0-15.0", 0.0, 15.0}};
  for (const auto& piece : pieces) {
    const std::size_t first = packet_at(recording, piece.from),
                      last = packet_at(recording, piece.to);
    const OdometryRun run = run_odometry(recording, first, last, tracker, config);
    print_piece(piece.name, run, last - first);
    if (run.states.size() >= 3)
      for (const std::size_t steps : {1U, 3U, 8U}) print_consistency(run, steps);
  }
  if (black) run_black(recording, tracker, config);
  if (!starts) return 0;
  std::vector<double> ate, late, rotation, tilt;
  int lost = 0;
  for (int s = 0; s <= 20; ++s) {
    const std::size_t first = packet_at(recording, 0.5 * s),
                      last = packet_at(recording, 0.5 * s + 5.0);
    const OdometryRun run = run_odometry(recording, first, last, tracker, config);
    if (run.states.size() != last - first || run.statistics.starts != 1) {
      ++lost;
      std::printf("start %.1f: %zu of %zu poses, %d starts\n", 0.5 * s, run.states.size(),
                  last - first, run.statistics.starts);
      if (run.states.size() < 3) continue;
    }
    const OdometryErrors errors = errors_since(run, 0.0);
    ate.push_back(1e3 * errors.ate_m);
    late.push_back(1e3 * errors_since(run, 2.0).ate_m);
    rotation.push_back(errors.rpe_deg);
    tilt.push_back(errors.tilt_deg);
    std::printf("%.1f:%.1f(%.2fdeg) ", 0.5 * s, ate.back(), rotation.back());
  }
  std::printf(
      "\n21 starts: lost %d, ATE median %.1f p90 %.1f max %.1f mm; from +2 s %.1f %.1f %.1f; "
      "RPE %.3f max %.3f deg; tilt %.2f max %.2f deg\n",
      lost, quantile(ate, 0.5), quantile(ate, 0.9), quantile(ate, 1.0), quantile(late, 0.5),
      quantile(late, 0.9), quantile(late, 1.0), quantile(rotation, 0.5), quantile(rotation, 1.0),
      quantile(tilt, 0.5), quantile(tilt, 1.0));
  return 0;
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  if (argc < 2) {
    std::cerr
        << "usage: bench_vio DATASET [rgbd] [starts] [black] [resume=SECONDS] [rest=SECONDS]\n"
           "                 [flight=SECONDS] [late=MILLISECONDS] [turned=DEGREES] [KEY=VALUE "
           "...]\n";
    return 2;
  }
  return km::run(argc, argv);
} catch (const std::exception& error) {
  std::cerr << "bench_vio: " << error.what() << '\n';
  return 1;
}
