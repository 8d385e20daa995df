#include "modules/evaluation/trajectory_file.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

#include "modules/core/camera/calibration_limits.hpp"
#include "modules/core/data/covariance.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/evaluation/input_row.hpp"

namespace km {
namespace {

constexpr std::size_t kFields = 8;
// 146 years, so that differences fit
constexpr Stamp kMaxStamp = std::numeric_limits<Stamp>::max() / 2;
constexpr double kMaxRate_hz = 5000.0;  // more poses a second show another unit of time

// The columns of a table of poses.
struct Columns {
  std::size_t stamp = 0, pose = 1;  // the first of p x y z and the quaternion
  bool w_first = false;             // order of the quaternion
  bool is_ns = false;               // stamps are whole nanoseconds
  bool is_named = false;            // by a header
};

// Converts a time to nanoseconds without the rounding of a double, which is 240 ns today. The size
// of present times shows their unit: 1e9 s, 1e12 ms, 1e15 us, 1e18 ns.
std::optional<Stamp> parse_time(std::string_view field) {
  long double value = 0.0L;
  const char* const end = field.data() + field.size();
  const auto [stopped, error] = std::from_chars(field.data(), end, value);
  if (error != std::errc() || stopped != end) return std::nullopt;
  long double unit_ns = 1e9L;
  for (long double least = 3e10L; unit_ns > 1.0L && std::abs(value) >= least; least *= 1e3L)
    unit_ns /= 1e3L;
  if (!(std::abs(value * unit_ns) < 9.2e18L)) return std::nullopt;
  return static_cast<Stamp>(std::llround(value * unit_ns));
}

// The lines above the first row of numbers, without "#".
std::string_view header_of(std::string_view text) {
  std::size_t end = 0;
  for (std::size_t line = 0; line < text.size(); line = end) {
    end = std::min(text.find_first_of("\r\n", line), text.size() - 1) + 1;
    const auto rows = split_rows(text.substr(line, end - line));
    if (!rows.empty() && number_in(rows.front(), 0)) return text.substr(0, line);
  }
  return {};
}

// "q_ws_x" of "q_WS_x []".
std::string column_name(std::string_view field) {
  std::string name(field.substr(0, field.find_first_of(" [(")));
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name;
}

// The columns that the last line of a header names; nullopt unless it names a quaternion.
std::optional<Columns> named_columns(std::string_view header, const std::string& file) {
  std::string text(header);
  std::ranges::replace(text, '#', ' ');
  std::optional<Columns> columns;
  const auto lines = split_rows(text);
  for (const TextRow& line : lines) {
    std::vector<std::string> names;
    for (const std::string_view field : line.fields)
      if (const std::string name = column_name(field); !name.empty()) names.push_back(name);
    const auto first = std::ranges::find_if(names, [](const std::string& name) {
      return name.starts_with('q') && (name.ends_with('x') || name.ends_with('w'));
    });
    if (first == names.end()) continue;
    const auto at = static_cast<std::size_t>(first - names.begin());
    if (at < 4 || !names[at - 3].ends_with('x') || names.size() < at + 4)
      throw InputFileError(file + " line " + std::to_string(line.line) +
                           ": the columns before the quaternion are not a stamp and x, y, z");
    const auto stamp = std::ranges::find_if(names, [](const std::string& name) {
      return name == "t" || name.find("time") != name.npos || name.find("stamp") != name.npos;
    });
    columns = {.stamp = stamp < first ? static_cast<std::size_t>(stamp - names.begin()) : 0,
               .pose = at - 3,
               .w_first = first->ends_with('w'),
               .is_named = true};
  }
  return columns;
}

// EuRoC's rows have commas, TUM's have blanks.
Columns columns_of(std::string_view text, const TextRow& first, const std::string& file) {
  const auto named = named_columns(header_of(text), file);
  Columns columns = named.value_or(Columns());
  const std::string_view head = first.fields.front();
  const auto after_first = static_cast<std::size_t>(head.data() + head.size() - text.data());
  const std::size_t separator = text.find_first_not_of(" \t", after_first);
  const bool has_commas =
      separator != text.npos && (text[separator] == ',' || text[separator] == ';');
  if (!named) columns.w_first = has_commas;
  const bool is_whole = columns.stamp < first.fields.size() &&
                        first.fields[columns.stamp].find_first_of(".eE") == std::string_view::npos;
  columns.is_ns = has_commas && (!named || is_whole);
  return columns;
}

// The pose in a row, with its stamp.
StampedPose pose_of(const InputRow& row, const Columns& columns) {
  const std::size_t fields = std::max(kFields, columns.pose + 7);
  if (row.size() < fields)
    row.fail(std::to_string(row.size()) + " fields, expected " + std::to_string(fields) +
             (columns.is_named ? " as the header states"
              : columns.is_ns  ? " or more (EuRoC: t[ns], p x y z, q w x y z)"
                               : " (TUM: t[s], p x y z, q x y z w)"));
  const std::string_view time = row.text(columns.stamp);
  const auto stamp = columns.is_ns ? parse_int64(time) : parse_time(time);
  if (!stamp || *stamp > kMaxStamp || *stamp < -kMaxStamp)
    row.fail(std::string(time) + " is not a stamp in " +
             (columns.is_ns ? "nanoseconds" : "seconds") +
             (columns.is_ns && !columns.is_named
                  ? "; with commas or semicolons and seconds a header must name the columns, as in "
                    "timestamp,tx,ty,tz,qx,qy,qz,qw"
                  : ""));
  return {*stamp, row.pose(columns.pose, columns.w_first)};
}

// A wrong unit of time makes a rate that no odometry has.
void check_rate(const std::vector<StampedPose>& poses, const std::string& name) {
  constexpr std::size_t kLeast = 10;
  if (poses.size() < kLeast) return;
  const double rate_hz = static_cast<double>(poses.size() - 1) /
                         seconds_between(poses.front().stamp, poses.back().stamp);
  if (rate_hz > kMaxRate_hz)
    throw InputFileError(name + ": " + shortest_text(std::round(rate_hz)) +
                         " poses a second: stamps are to be nanoseconds; are they microseconds, "
                         "milliseconds or seconds?");
}

// KITTI's rows: the upper three rows of a pose as a 4x4 matrix.
std::optional<SE3> matrix_in(const TextRow& row) {
  if (row.fields.size() != 12) return std::nullopt;
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  for (std::size_t k = 0; k < 12; ++k)
    T(static_cast<Eigen::Index>(k / 4), static_cast<Eigen::Index>(k % 4)) =
        number_in(row, k).value_or(std::numeric_limits<double>::quiet_NaN());
  return transform_problem(T) ? std::nullopt : std::optional(rigid_transform(T));
}

// Poses of KITTI, whose stamps are in times.txt beside it or in the folder of the sequence.
std::vector<StampedPose> read_kitti(const std::vector<TextRow>& rows, const std::string& name) {
  const std::filesystem::path file(name), folder = file.parent_path();
  std::filesystem::path times = folder / "times.txt";
  if (!is_file(times)) times = folder / ".." / "sequences" / file.stem() / "times.txt";
  if (!is_file(times))
    throw InputFileError(name + ": poses of KITTI have no stamps: put times.txt beside it");
  const std::string text = read_input_file(times);
  const std::vector<TextRow> stamps = split_rows(text);
  if (stamps.size() < rows.size())
    throw InputFileError(times.string() + ": fewer times than poses in " + name);
  std::vector<StampedPose> poses;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const InputRow row(name, rows[k]);
    const auto T = matrix_in(rows[k]);
    const auto stamp = parse_time(stamps[k].fields.front());
    if (!T || !stamp) row.fail("is no pose of KITTI with a time");
    if (!poses.empty() && *stamp <= poses.back().stamp) row.fail("its time is not after the last");
    poses.push_back({*stamp, *T});
  }
  return poses;
}

// The covariance behind the pose T of a row, converted from fixed axes to the axes of T.
Matrix6 covariance_of(const InputRow& row, const SE3& T) {
  if (row.size() != kFields + 36)
    row.fail(std::to_string(row.size()) +
             " fields, expected 44: t[s], p x y z, q x y z w, and 36 of the covariance");
  Matrix6 along_axes;
  for (Eigen::Index k = 0; k < 36; ++k)
    along_axes(k / 6, k % 6) = row.number(kFields + static_cast<std::size_t>(k));
  return from_fixed_axes(T, along_axes);
}

// Calls use(row, pose) for every row, except for rows with the stamp of the row before. For `skip`
// see read_uncertain_trajectory().
void for_each_pose(std::string_view text, const std::string& name, const auto& use,
                   const std::function<void(const std::string&)>& skip = nullptr) {
  std::vector<TextRow> rows = split_rows(text);
  if (!rows.empty() && !rows.front().fields.front().empty() &&
      std::isalpha(static_cast<unsigned char>(rows.front().fields.front().front())) != 0)
    rows.erase(rows.begin());
  if (rows.empty()) throw InputFileError(name + ": holds no pose");
  const Columns columns = columns_of(text, rows.front(), name);
  std::optional<Stamp> last;
  for (const TextRow& fields : rows) try {
      const InputRow row(name, fields);
      const StampedPose pose = pose_of(row, columns);
      if (last && pose.stamp < *last && !skip) row.fail("the stamp is before the last one");
      if (last != pose.stamp) use(row, pose);
      last = pose.stamp;
    } catch (const InputFileError& error) {
      if (!skip) throw;
      skip(error.what());
    }
}

// Calls use(text, name) with the content and the name of the file at `place`.
auto with_file(const std::filesystem::path& place, const auto& use) {
  const auto file = find_trajectory(place);
  if (!file) {
    const std::string problem = problem_of_file(place);
    throw InputFileError(place.string() + ": " +
                         (is_folder(place)  ? "no data.csv or groundtruth_tum.txt in it"
                          : problem.empty() ? "not a file"
                                            : problem));
  }
  const std::string text = read_input_file(*file);
  for (const std::string_view magic : {"#ROSBAG", "\x89MCAP", "SQLite format", "\x28\xB5\x2F\xFD"})
    if (text.starts_with(magic))
      throw InputFileError(file->string() +
                           ": is a recording, not a table of poses; of a file .mcap name the "
                           "topic, as in " +
                           file->filename().string() + ":/robot/path");
  return use(text, file->string());
}

}  // namespace

std::vector<StampedPose> parse_trajectory(std::string_view text, const std::string& name) {
  std::vector<StampedPose> poses;
  for_each_pose(text, name,
                [&](const InputRow&, const StampedPose& pose) { poses.push_back(pose); });
  check_rate(poses, name);
  return poses;
}

std::optional<std::filesystem::path> find_trajectory(const std::filesystem::path& place) {
  if (is_file(place)) return place;
  for (const char* folder : {"", "state_groundtruth_estimate0", "mav0/state_groundtruth_estimate0"})
    for (const char* name : {"data.csv", "groundtruth_tum.txt"})
      if (is_file(place / folder / name)) return place / folder / name;
  return std::nullopt;
}

std::vector<StampedPose> read_trajectory(const std::filesystem::path& place) {
  return with_file(place, [](const std::string& text, const std::string& name) {
    const std::vector<TextRow> rows = split_rows(text);
    return !rows.empty() && matrix_in(rows.front()) ? read_kitti(rows, name)
                                                    : parse_trajectory(text, name);
  });
}

UncertainTrajectory read_uncertain_trajectory(const std::filesystem::path& place,
                                              const std::function<void(const std::string&)>& skip) {
  return with_file(place, [&](const std::string& text, const std::string& name) {
    UncertainTrajectory result;
    const auto add = [&](const StampedPose& pose, const Matrix6& Sigma, int line) {
      result.poses.push_back(pose);
      result.covariances.push_back(Sigma);
      result.lines.push_back(line);
    };
    const std::vector<TextRow> rows = split_rows(text);
    if (skip && !rows.empty() && matrix_in(rows.front()))
      for (const StampedPose& pose : read_kitti(rows, name))
        add(pose, Matrix6::Zero(), static_cast<int>(result.lines.size()) + 1);
    else
      for_each_pose(
          text, name,
          [&](const InputRow& row, const StampedPose& pose) {
            const bool is_bare = skip && row.size() != kFields + 36;
            add(pose, is_bare ? Matrix6::Zero() : covariance_of(row, pose.T), row.line());
          },
          skip);
    return result;
  });
}

}  // namespace km
