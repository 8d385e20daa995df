#include "modules/evaluation/trajectory_file.hpp"

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "modules/core/config.hpp"
#include "modules/core/covariance.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/text_rows.hpp"

namespace km {
namespace {

constexpr std::size_t kFields = 8;
constexpr double kMaxNormError = 0.01;
constexpr double kMaxCoordinate_m = 1e9;  // far beyond the earth; squares keep their digits
// 146 years, so that differences fit
constexpr Stamp kMaxStamp = std::numeric_limits<Stamp>::max() / 2;

// Converts seconds to nanoseconds without the rounding of a double, which is 240 ns today.
std::optional<Stamp> parse_seconds(std::string_view field) {
  long double seconds = 0.0L;
  const char* const end = field.data() + field.size();
  const auto [stopped, error] = std::from_chars(field.data(), end, seconds);
  if (error != std::errc() || stopped != end || !(std::abs(seconds) < 9e9L)) return std::nullopt;
  return static_cast<Stamp>(std::llround(seconds * 1e9L));
}

class RowParser {
 public:
  RowParser(const std::string& name, const TextRow& row) : name_(name), row_(row) {}

  StampedPose parse(bool euroc) const {
    if (row_.fields.size() < kFields)
      fail(std::to_string(row_.fields.size()) + " fields, expected " + std::to_string(kFields) +
           (euroc ? " or more (EuRoC: t[ns], p x y z, q w x y z)"
                  : " (TUM: t[s], p x y z, q x y z w)"));
    const std::string_view head = row_.fields.front();
    const auto stamp = euroc ? parse_int64(head) : parse_seconds(head);
    if (!stamp || *stamp > kMaxStamp || *stamp < -kMaxStamp)
      fail(std::string(head) + " is not a stamp in " + (euroc ? "nanoseconds" : "seconds"));

    std::array<double, kFields> v{};
    for (std::size_t i = 1; i < kFields; ++i) v[i] = number(row_.fields[i]);
    Eigen::Quaterniond q = euroc ? Eigen::Quaterniond(v[4], v[5], v[6], v[7])
                                 : Eigen::Quaterniond(v[7], v[4], v[5], v[6]);
    if (std::abs(q.norm() - 1.0) > kMaxNormError)
      fail("the quaternion's norm is " + std::to_string(q.norm()));
    q.normalize();
    for (const double coordinate : {v[1], v[2], v[3]})
      if (std::abs(coordinate) > kMaxCoordinate_m)
        fail("a coordinate of " + shortest_text(coordinate) + " m is beyond " +
             shortest_text(kMaxCoordinate_m));
    return {*stamp, make_pose(q.toRotationMatrix(), {v[1], v[2], v[3]})};
  }

  // Converts the covariance along fixed axes to that along the axes of the pose.
  Matrix6 parse_covariance(const SE3& T) const {
    Matrix6 along_axes;
    if (row_.fields.size() != kFields + 36)
      fail(std::to_string(row_.fields.size()) +
           " fields, expected 44: t[s], p x y z, q x y z w, and 36 of the covariance");
    for (Eigen::Index k = 0; k < 36; ++k)
      along_axes(k / 6, k % 6) = number(row_.fields[kFields + static_cast<std::size_t>(k)]);
    return from_fixed_axes(T, along_axes);
  }

  [[noreturn]] void fail(const std::string& problem) const {
    throw TrajectoryFileError(name_ + " line " + std::to_string(row_.line) + ": " +
                              readable(problem));
  }

 private:
  double number(std::string_view field) const {
    const auto value = parse_double(field);
    if (!value || !std::isfinite(*value)) fail(std::string(field) + " is not a finite number");
    return *value;
  }

  const std::string& name_;
  const TextRow& row_;
};

bool is_header(const TextRow& row) {
  return !row.fields.front().empty() &&
         std::isalpha(static_cast<unsigned char>(row.fields.front().front())) != 0;
}

// Calls use(parser, pose) for every row, except for rows with the stamp of the row before.
void for_each_pose(std::string_view text, const std::string& name, const auto& use) {
  std::vector<TextRow> rows = split_rows(text);
  if (!rows.empty() && is_header(rows.front())) rows.erase(rows.begin());
  if (rows.empty()) throw TrajectoryFileError(name + ": holds no pose");
  const std::string_view first = rows.front().fields.front();
  const auto after_first = static_cast<std::size_t>(first.data() + first.size() - text.data());
  const std::size_t separator = text.find_first_not_of(" \t", after_first);
  const bool euroc = separator != text.npos && text[separator] == ',';
  std::optional<Stamp> last;
  for (const TextRow& row : rows) {
    const RowParser parser(name, row);
    const StampedPose pose = parser.parse(euroc);
    if (last && pose.stamp < *last) parser.fail("the stamp is before the last one");
    if (last != pose.stamp) use(parser, pose);
    last = pose.stamp;
  }
}

// Calls use(text, name) with the content and the name of the file at `place`.
auto with_file(const std::filesystem::path& place, const auto& use) {
  const auto file = find_trajectory(place);
  if (!file) {
    const std::string problem = problem_of_file(place);
    throw TrajectoryFileError(place.string() + ": " +
                              (is_folder(place)  ? "no data.csv or groundtruth_tum.txt in it"
                               : problem.empty() ? "not a file"
                                                 : problem));
  }
  try {
    return use(read_input_file(*file), file->string());
  } catch (const InputFileError& error) {
    throw TrajectoryFileError(error.what());
  }
}

}  // namespace

std::vector<StampedPose> parse_trajectory(std::string_view text, const std::string& name) {
  std::vector<StampedPose> poses;
  for_each_pose(text, name,
                [&](const RowParser&, const StampedPose& pose) { poses.push_back(pose); });
  return poses;
}

std::optional<std::filesystem::path> find_trajectory(const std::filesystem::path& place) {
  for (const auto& file : {place, place / "data.csv", place / "groundtruth_tum.txt"})
    if (is_file(file)) return file;
  return std::nullopt;
}

std::vector<StampedPose> read_trajectory(const std::filesystem::path& place) {
  return with_file(place, [](const std::string& text, const std::string& name) {
    return parse_trajectory(text, name);
  });
}

UncertainTrajectory read_uncertain_trajectory(const std::filesystem::path& place) {
  return with_file(place, [](const std::string& text, const std::string& name) {
    UncertainTrajectory result;
    for_each_pose(text, name, [&](const RowParser& parser, const StampedPose& pose) {
      result.poses.push_back(pose);
      result.covariances.push_back(parser.parse_covariance(pose.T));
    });
    return result;
  });
}

}  // namespace km
