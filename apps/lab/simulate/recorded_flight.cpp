#include "apps/lab/simulate/recorded_flight.hpp"

#include <zlib.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "apps/lab/simulation/motion/steady_rotations.hpp"
#include "modules/core/text_rows.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxNormError = 0.01;  // largest error of the norm of a quaternion

// Text of a file, decompressed if it is gzipped (zlib passes other files through), and its check
// sum.
struct Table {
  fs::path file;
  std::string text;

  explicit Table(const fs::path& path) : file(path) {
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
    return file.filename().string() + " (crc32 " + digits.data() + ')';
  }

  [[noreturn]] void fail(const TextRow& row, const std::string& why) const {
    throw std::runtime_error(file.string() + " line " + std::to_string(row.line) + ": " + why);
  }
};

// A number in field `i`; fields beyond the last count as 0 if they may be missing.
double number(const Table& table, const TextRow& row, std::size_t i, bool required = true) {
  if (i >= row.fields.size()) {
    if (!required) return 0.0;
    table.fail(row, "has only " + std::to_string(row.fields.size()) + " fields");
  }
  const auto value = parse_double(row.fields[i]);
  if (!value || !std::isfinite(*value))
    table.fail(row, "'" + std::string(row.fields[i]) + "' is not a number");
  return *value;
}

Eigen::Vector3d vector(const Table& table, const TextRow& row, std::size_t i,
                       bool required = true) {
  const double x = number(table, row, i, required);
  const double y = number(table, row, i + 1, required);
  const double z = number(table, row, i + 2, required);
  return {x, y, z};
}

Eigen::Quaterniond rotation(const Table& table, const TextRow& row, double w,
                            const Eigen::Vector3d& v) {
  const Eigen::Quaterniond q(w, v.x(), v.y(), v.z());
  if (std::abs(q.norm() - 1.0) > kMaxNormError)
    table.fail(row, "the quaternion's norm is " + std::to_string(q.norm()));
  return q.normalized();
}

// EuRoC: t[ns], p, q_wxyz, v, b_g, b_a.
TrueState euroc_state(const Table& table, const TextRow& row) {
  const auto stamp = parse_int64(row.fields.front());
  if (!stamp) table.fail(row, std::string(row.fields.front()) + " is not a stamp in nanoseconds");
  const auto q = rotation(table, row, number(table, row, 4), vector(table, row, 5));
  return {*stamp, make_pose(q.toRotationMatrix(), vector(table, row, 1)),
          vector(table, row, 8, false), vector(table, row, 11, false),
          vector(table, row, 14, false)};
}

// TUM: t[s] p q_xyzw.
TrueState tum_state(const Table& table, const TextRow& row) {
  const double t_s = number(table, row, 0);
  const auto q = rotation(table, row, number(table, row, 7), vector(table, row, 4));
  TrueState state;
  state.stamp = static_cast<Stamp>(std::llround(t_s * 1e9));
  state.T_world_body = make_pose(q.toRotationMatrix(), vector(table, row, 1));
  return state;
}

bool is_header(const TextRow& row) {
  return !parse_double(row.fields.front());
}

template <typename Row, typename Parse>
std::vector<Row> read_rows(const Table& table, const Parse& parse) {
  std::vector<Row> rows;
  for (const TextRow& row : split_rows(table.text)) {
    if (rows.empty() && is_header(row)) continue;
    const Row parsed = parse(row);
    if (!rows.empty() && parsed.stamp < rows.back().stamp)
      table.fail(row, "comes before the row above it");
    if (rows.empty() || parsed.stamp > rows.back().stamp) rows.push_back(parsed);
  }
  if (rows.size() < 2) throw std::runtime_error(table.file.string() + ": holds no data");
  return rows;
}

bool is_comma_separated(const Table& table) {
  return table.text.find(',') != std::string::npos;
}

std::vector<StampedPose> poses_of(const std::vector<TrueState>& truth) {
  std::vector<StampedPose> poses;
  poses.reserve(truth.size());
  for (const TrueState& state : truth) poses.push_back({state.stamp, state.T_world_body});
  return poses;
}

// Description of the bridged gaps; empty if there are none.
std::string bridging(const BridgedPoses& motion) {
  if (motion.gaps + motion.open_gaps == 0) return {};
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                ", %zu gaps of the truth of up to %.2f s bridged by inertial data, which meets the "
                "truth beside them to %.1f mm rms, %.1f mm at most; %zu gaps without such data",
                motion.gaps, motion.longest_s, 1e3 * motion.rms_m, 1e3 * motion.max_m,
                motion.open_gaps);
  return text.data();
}

// Removes the jitter of the rotations. Returns a description of the change.
std::string remove_rotation_jitter(RecordedFlight& flight) {
  const SteadiedPoses steadied = steady_rotations(poses_of(flight.truth), flight.imu);
  for (std::size_t k = 0; k < flight.truth.size(); ++k)
    flight.truth[k].T_world_body = steadied.poses[k].T;
  std::array<char, 100> text{};
  std::snprintf(text.data(), text.size(),
                ", rotations steadied by the gyroscope: %.2f mrad rms, %.1f mrad at most",
                1e3 * steadied.rms_rad, 1e3 * steadied.max_rad);
  return text.data();
}

}  // namespace

RecordedFlight read_recorded_flight(const fs::path& truth, const fs::path& imu, bool steady) {
  const Table states(truth);
  const Table samples(imu);
  RecordedFlight flight;
  const bool euroc = is_comma_separated(states);
  flight.truth = read_rows<TrueState>(states, [&](const TextRow& row) {
    return euroc ? euroc_state(states, row) : tum_state(states, row);
  });
  flight.imu = read_rows<ImuSample>(samples, [&](const TextRow& row) {
    const auto stamp = parse_int64(row.fields.front());
    if (!stamp) samples.fail(row, "does not begin with a stamp in nanoseconds");
    return ImuSample{*stamp, vector(samples, row, 1), vector(samples, row, 4)};
  });
  flight.fingerprint = states.fingerprint() + ", " + samples.fingerprint();
  if (flight.imu.back().stamp <= flight.truth.front().stamp ||
      flight.truth.back().stamp <= flight.imu.front().stamp)
    throw std::runtime_error(truth.string() + " and " + imu.string() + " do not overlap in time");
  if (steady) flight.fingerprint += remove_rotation_jitter(flight);
  flight.motion = bridge_gaps(poses_of(flight.truth), flight.imu);
  flight.fingerprint += bridging(flight.motion);
  return flight;
}

}  // namespace km
