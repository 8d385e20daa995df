#include "modules/evaluation/trajectory_file.hpp"

#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "modules/core/covariance.hpp"
#include "modules/core/input_file.hpp"
#include "modules/evaluation/input_row.hpp"

namespace km {
namespace {

constexpr std::size_t kFields = 8;
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

// The pose at the start of a row, with its stamp.
StampedPose pose_of(const InputRow& row, bool euroc) {
  if (row.size() < kFields)
    row.fail(std::to_string(row.size()) + " fields, expected " + std::to_string(kFields) +
             (euroc ? " or more (EuRoC: t[ns], p x y z, q w x y z)"
                    : " (TUM: t[s], p x y z, q x y z w)"));
  const auto stamp = euroc ? parse_int64(row.text(0)) : parse_seconds(row.text(0));
  if (!stamp || *stamp > kMaxStamp || *stamp < -kMaxStamp)
    row.fail(std::string(row.text(0)) + " is not a stamp in " +
             (euroc ? "nanoseconds" : "seconds"));
  return {*stamp, row.pose(1, euroc)};
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

bool is_header(const TextRow& row) {
  return !row.fields.front().empty() &&
         std::isalpha(static_cast<unsigned char>(row.fields.front().front())) != 0;
}

// Calls use(row, pose) for every row, except for rows with the stamp of the row before.
void for_each_pose(std::string_view text, const std::string& name, const auto& use) {
  std::vector<TextRow> rows = split_rows(text);
  if (!rows.empty() && is_header(rows.front())) rows.erase(rows.begin());
  if (rows.empty()) throw InputFileError(name + ": holds no pose");
  const std::string_view first = rows.front().fields.front();
  const auto after_first = static_cast<std::size_t>(first.data() + first.size() - text.data());
  const std::size_t separator = text.find_first_not_of(" \t", after_first);
  const bool euroc = separator != text.npos && text[separator] == ',';
  std::optional<Stamp> last;
  for (const TextRow& fields : rows) {
    const InputRow row(name, fields);
    const StampedPose pose = pose_of(row, euroc);
    if (last && pose.stamp < *last) row.fail("the stamp is before the last one");
    if (last != pose.stamp) use(row, pose);
    last = pose.stamp;
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
  return use(read_input_file(*file), file->string());
}

}  // namespace

std::vector<StampedPose> parse_trajectory(std::string_view text, const std::string& name) {
  std::vector<StampedPose> poses;
  for_each_pose(text, name,
                [&](const InputRow&, const StampedPose& pose) { poses.push_back(pose); });
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
    for_each_pose(text, name, [&](const InputRow& row, const StampedPose& pose) {
      result.poses.push_back(pose);
      result.covariances.push_back(covariance_of(row, pose.T));
    });
    return result;
  });
}

}  // namespace km
