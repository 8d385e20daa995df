#include "apps/lab/simulate/robot_scenario.hpp"

#include <zlib.h>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/motion/imu_simulator.hpp"
#include "apps/lab/simulation/motion/sensor_errors.hpp"
#include "apps/lab/simulation/motion/vehicle_trajectory.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/evaluation/input_row.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Text of a file, decompressed if it is gzipped (zlib passes other files through), and its check
// sum.
struct Table {
  std::string file, text;

  explicit Table(const fs::path& path) : file(path.string()) {
    const gzFile stream = gzopen(path.c_str(), "rb");
    if (stream == nullptr) throw std::runtime_error(path.string() + ": cannot be read");
    std::vector<char> buffer(1 << 16);
    int n = 0;
    while ((n = gzread(stream, buffer.data(), static_cast<unsigned>(buffer.size()))) > 0)
      text.append(buffer.data(), static_cast<std::size_t>(n));
    const bool truncated = gzclose_r(stream) == Z_BUF_ERROR;
    if (n < 0 || truncated)
      throw std::runtime_error(path.string() + ": damaged gzip file, or cannot be read");
  }

  [[nodiscard]] std::string fingerprint() const {
    const uLong sum = crc32_z(0, reinterpret_cast<const Bytef*>(text.data()), text.size());
    std::array<char, 16> digits{};
    std::snprintf(digits.data(), digits.size(), "%08lx", sum);
    return fs::path(file).filename().string() + " (crc32 " + digits.data() + ')';
  }
};

Stamp stamp_of(const InputRow& row) {
  return row.integer(0, std::numeric_limits<Stamp>::max());
}

// Zero if the row has no such fields.
Eigen::Vector3d vector(const InputRow& row, std::size_t i) {
  if (row.size() < i + 3) return Eigen::Vector3d::Zero();
  return {row.number(i), row.number(i + 1), row.number(i + 2)};
}

// Rows of at least `fields` fields.
template <typename Row>
std::vector<Row> read_rows(const Table& table, std::size_t fields, const auto& parse) {
  std::vector<Row> rows;
  for (const TextRow& text : split_rows(table.text)) {
    if (rows.empty() && !parse_double(text.fields.front())) continue;  // a header
    const InputRow row(table.file, text);
    if (row.size() < fields) row.fail("has only " + std::to_string(row.size()) + " fields");
    const Row parsed = parse(row);
    if (!rows.empty() && parsed.stamp < rows.back().stamp)
      row.fail("comes before the row above it");
    if (rows.empty() || parsed.stamp > rows.back().stamp) rows.push_back(parsed);
  }
  if (rows.size() < 2) throw std::runtime_error(table.file + ": holds no data");
  return rows;
}

}  // namespace

RecordedFlight read_recorded_flight(const fs::path& truth, const fs::path& imu) {
  const Table states(truth);
  const Table samples(imu);
  RecordedFlight flight;
  // EuRoC: t[ns], p, q_wxyz, v, b_g, b_a.
  flight.truth = read_rows<TrueState>(states, 8, [](const InputRow& row) {
    return TrueState{stamp_of(row), row.pose(1, true), vector(row, 8), vector(row, 11),
                     vector(row, 14)};
  });
  flight.imu = read_rows<ImuSample>(samples, 7, [](const InputRow& row) {
    return ImuSample{stamp_of(row), vector(row, 1), vector(row, 4)};
  });
  flight.fingerprint = states.fingerprint() + ", " + samples.fingerprint();
  if (flight.imu.back().stamp <= flight.truth.front().stamp ||
      flight.truth.back().stamp <= flight.imu.front().stamp)
    throw std::runtime_error(truth.string() + " and " + imu.string() + " do not overlap in time");
  return flight;
}

namespace {

constexpr double kImuLead_s = 1.0;           // inertial data begin this long before the first image
constexpr double kImuTail_s = 0.1;           // inertial data end this long after the last image
constexpr Stamp kEpoch = 1'000'000'000'000;  // readers require stamps above 0
// Parts of a robot's seed.
constexpr std::uint64_t kMotion = 1, kImu = 2, kInertial = 4, kCalibration = 5, kClock = 6,
                        kDropped = 7;

// First + k / rate, up to `last`.
std::vector<Stamp> image_stamps(Stamp first, Stamp last, double rate_hz) {
  std::vector<Stamp> stamps;
  for (std::size_t k = 0;; ++k) {
    const Stamp stamp =
        first + static_cast<Stamp>(std::llround(static_cast<double>(k) * 1e9 / rate_hz));
    if (stamp > last) return stamps;
    stamps.push_back(stamp);
  }
}

Route route_of(const World& world, std::size_t robot, bool opposite) {
  const std::vector<Route>& routes = world.routes;
  if (!opposite) return routes[robot % routes.size()];
  const Route& shared = routes[robot / 2 % routes.size()];
  return robot % 2 == 0 ? shared : opposite_route(shared);
}

std::unique_ptr<const BodyTrajectory> drive(const World& world, std::size_t robot, bool opposite,
                                            std::uint64_t seed, double duration_s) {
  const Route route = route_of(world, robot, opposite);
  VehicleOptions vehicle{.seed = seed, .duration_s = duration_s};
  return std::make_unique<SplineTrajectory>(
      make_vehicle_trajectory(route, world.ground_height, vehicle));
}

std::unique_ptr<const BodyTrajectory> fly(const World& world, std::uint64_t seed,
                                          double duration_s) {
  FlightOptions flight{.seed = seed,
                       .duration_s = duration_s,
                       .R_vehicle_body = vehicle_from_body(RigKind::kFlying)};
  return std::make_unique<SplineTrajectory>(make_flight_trajectory(world.flight_volume, flight));
}

// Gives the scenario the calibration that the robot gets, the stamps of its clocks, and lost
// images.
void add_told_values(const SimulationOptions& options, RobotScenario& scenario) {
  const TimingErrorConfig& timing = options.effects.timing;
  scenario.told_rig = told_rig(scenario.rig, options.effects.calibration_error,
                               derived_seed(scenario.seed, kCalibration));
  scenario.images = without_dropped(scenario.images, timing, derived_seed(scenario.seed, kDropped));
  const RobotClock clock(timing, scenario.imu.front().stamp, scenario.imu.back().stamp,
                         derived_seed(scenario.seed, kClock));
  for (const Stamp at : scenario.images) scenario.image_stamps.push_back(clock.camera(at));
  for (ImuSample& sample : scenario.imu) sample.stamp = clock.inertial(sample.stamp);
  for (TrueState& state : scenario.truth) state.stamp = clock.inertial(state.stamp);
}

RobotScenario simulated_robot(const World& world, const SimulationOptions& options,
                              std::size_t robot) {
  const bool drives = !world.routes.empty();
  const double duration_s = kImuLead_s + options.duration_s + kImuTail_s;
  RobotScenario scenario;
  scenario.name = options.names[robot];
  scenario.seed = derived_seed(options.seed, robot);
  scenario.rig =
      default_rig(drives ? RigKind::kVehicle : RigKind::kFlying, options.width, options.height);
  scenario.epoch = kEpoch;
  const std::uint64_t seed = derived_seed(scenario.seed, kMotion);
  scenario.trajectory = drives
                            ? drive(world, robot, options.effects.places.opposite, seed, duration_s)
                            : fly(world, seed, duration_s);
  const Stamp first = kEpoch + nanoseconds(kImuLead_s);
  scenario.images =
      image_stamps(first, first + nanoseconds(options.duration_s) - 1, options.rate_hz);

  ImuSimulation imu;
  imu.noise = scenario.rig.imu;
  imu.errors =
      draw_inertial_errors(options.effects.inertial, derived_seed(scenario.seed, kInertial));
  imu.seed = derived_seed(scenario.seed, kImu);
  for (const SimulatedImu& at : simulate_imu(*scenario.trajectory, kEpoch, imu)) {
    const BodyMotion motion = scenario.motion(at.sample.stamp);
    scenario.imu.push_back(at.sample);
    scenario.truth.push_back(
        {at.sample.stamp, motion.T_world_body, motion.velocity_world, at.gyro_bias, at.accel_bias});
  }
  add_told_values(options, scenario);
  return scenario;
}

// Rows from `from` to `to`, and one more on either side if it exists.
template <typename Row>
std::vector<Row> part_of(const std::vector<Row>& rows, Stamp from, Stamp to) {
  const auto before = [](const Row& row, Stamp stamp) { return row.stamp < stamp; };
  auto first = std::lower_bound(rows.begin(), rows.end(), from, before);
  auto last = std::lower_bound(first, rows.end(), to, before);
  if (first != rows.begin()) --first;
  if (last != rows.end()) ++last;
  return {first, last};
}

// Stamps of images, within the time of both truth and inertial data.
std::vector<Stamp> recorded_stamps(const RecordedFlight& flight, const SimulationOptions& options) {
  const Stamp origin = flight.truth.front().stamp;
  const Stamp last = std::min(flight.truth.back().stamp, flight.imu.back().stamp);
  const Stamp start = std::max(origin, flight.imu.front().stamp);
  const auto first =
      std::lower_bound(flight.imu.begin(), flight.imu.end(), start,
                       [](const ImuSample& sample, Stamp stamp) { return sample.stamp < stamp; });
  if (first == flight.imu.end()) return {};
  // The first image has the stamp of an inertial sample, as if that sample triggered the cameras.
  return image_stamps(std::max(first->stamp, origin), last, options.rate_hz);
}

RobotScenario recorded_robot(const RecordedFlight& flight, const SimulationOptions& options,
                             std::size_t robot) {
  RobotScenario scenario;
  scenario.name = options.names[robot];
  scenario.seed = derived_seed(options.seed, robot);
  scenario.rig = default_rig(RigKind::kFlying, options.width, options.height);
  scenario.images = recorded_stamps(flight, options);
  if (scenario.images.empty())
    throw std::invalid_argument(scenario.name + ": no inertial sample is within the flight");
  std::vector<StampedPose> poses;
  for (const TrueState& state : flight.truth) poses.push_back({state.stamp, state.T_world_body});
  scenario.epoch = poses.front().stamp;
  scenario.trajectory = std::make_unique<SplineTrajectory>(fit_recording(poses, scenario.epoch));
  const Stamp first = scenario.images.front();
  const Stamp last = scenario.images.back();
  scenario.imu =
      part_of(flight.imu, first - nanoseconds(kImuLead_s), last + nanoseconds(kImuTail_s));
  scenario.truth = part_of(flight.truth, first, last);
  add_told_values(options, scenario);
  return scenario;
}

}  // namespace

std::uint64_t derived_seed(std::uint64_t seed, std::uint64_t part) {
  return scrambled(seed + (part + 1) * 0x9E3779B97F4A7C15U);
}

std::vector<RobotScenario> simulated_robots(const World& world, const SimulationOptions& options) {
  std::vector<RobotScenario> robots;
  for (std::size_t i = 0; i < options.names.size(); ++i)
    robots.push_back(simulated_robot(world, options, i));
  return robots;
}

std::vector<RobotScenario> recorded_robots(const std::vector<RecordedFlight>& flights,
                                           const SimulationOptions& options) {
  std::vector<RobotScenario> robots;
  for (std::size_t i = 0; i < flights.size(); ++i)
    robots.push_back(recorded_robot(flights[i], options, i));
  return robots;
}

}  // namespace km
