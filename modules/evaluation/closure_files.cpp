#include "modules/evaluation/closure_files.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

#include "modules/core/text_rows.hpp"
#include "modules/evaluation/association.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxTruthGap_s = 0.1;  // as for trajectories: between poses further apart none is
constexpr double kMaxTruthDifference_s = 0.01;
constexpr double kMaxNormError = 0.01;  // of a quaternion
constexpr std::size_t kPoseColumn = 8;

constexpr std::array<std::pair<const char*, ClosureStage>, 5> kStages = {
    {{"candidate", ClosureStage::kCandidate},
     {"requested", ClosureStage::kRequested},
     {"received", ClosureStage::kReceived},
     {"verified", ClosureStage::kVerified},
     {"inlier", ClosureStage::kInlier}}};

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || !fs::is_regular_file(file))
    throw ClosureFileError(file.string() + ": no such file");
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string quoted(std::string_view text) {
  std::string result(1, '\'');
  return result.append(text).append(1, '\'');
}

// The fields of one row, by number.
class Fields {
 public:
  Fields(const fs::path& file, const TextRow& row, std::size_t expected) : file_(file), row_(row) {
    if (row.fields.size() < expected)
      fail(std::to_string(row.fields.size()) + " fields, expected " + std::to_string(expected));
  }

  [[noreturn]] void fail(const std::string& why) const {
    throw ClosureFileError(file_.string() + " line " + std::to_string(row_.line) + ": " + why);
  }

  [[nodiscard]] std::string_view text(std::size_t i) const { return row_.fields[i]; }

  [[nodiscard]] double number(std::size_t i) const {
    const auto value = parse_double(text(i));
    if (!value || !std::isfinite(*value)) fail(quoted(text(i)) + " is not a number");
    return *value;
  }

  [[nodiscard]] std::int64_t integer(std::size_t i, std::int64_t max) const {
    const auto value = parse_int64(text(i));
    if (!value || *value < 0 || *value > max)
      fail(quoted(text(i)) + " is not a number from 0 to " + std::to_string(max));
    return *value;
  }

  [[nodiscard]] KeyframeId keyframe(std::size_t i) const {
    return {static_cast<RobotId>(integer(i, std::numeric_limits<RobotId>::max())),
            static_cast<std::uint32_t>(integer(i + 1, std::numeric_limits<std::uint32_t>::max()))};
  }

  [[nodiscard]] SE3 pose(std::size_t i) const {
    const Eigen::Vector3d t(number(i), number(i + 1), number(i + 2));
    const Eigen::Quaterniond q(number(i + 6), number(i + 3), number(i + 4), number(i + 5));
    if (std::abs(q.norm() - 1.0) > kMaxNormError) fail("a quaternion is not of unit length");
    return make_pose(q.normalized().toRotationMatrix(), t);
  }

 private:
  const fs::path& file_;
  const TextRow& row_;
};

// Calls use(fields) for every row below the header.
template <typename Use>
void for_each_row(const fs::path& file, std::size_t expected, const Use& use) {
  const std::string text = content_of(file);
  bool header = true;
  for (const TextRow& row : split_rows(text)) {
    if (!std::exchange(header, false)) use(Fields(file, row, expected));
  }
}

ClosureStage stage_of(const Fields& fields, std::size_t i) {
  for (const auto& [name, stage] : kStages)
    if (fields.text(i) == name) return stage;
  fields.fail(quoted(fields.text(i)) + " is no stage of a closure");
}

}  // namespace

std::vector<KeyframeRecord> read_keyframes(const fs::path& file) {
  std::vector<KeyframeRecord> keyframes;
  for_each_row(file, 4, [&](const Fields& fields) {
    keyframes.push_back({fields.keyframe(0), fields.integer(2, std::numeric_limits<Stamp>::max()),
                         fields.number(3)});
  });
  return keyframes;
}

std::vector<ClosureRecord> read_closures(const fs::path& file) {
  std::vector<ClosureRecord> closures;
  for_each_row(file, kPoseColumn + 7, [&](const Fields& fields) {
    ClosureRecord closure;
    closure.id = {fields.keyframe(0), fields.keyframe(2)};
    closure.stage = stage_of(fields, 5);
    if (!fields.text(kPoseColumn).empty())
      closure.T_from_to = fields.pose(kPoseColumn);
    else if (closure.stage >= ClosureStage::kVerified)
      fields.fail("a verified closure without a pose");
    closures.push_back(std::move(closure));
  });
  return closures;
}

std::vector<TrueKeyframe> place_keyframes(std::span<const KeyframeRecord> keyframes,
                                          std::span<const StampedPose> truth) {
  std::vector<TrueKeyframe> placed;
  for (const KeyframeRecord& keyframe : keyframes)
    if (const auto T_world_body =
            pose_at(truth, keyframe.stamp, kMaxTruthGap_s, kMaxTruthDifference_s))
      placed.push_back({keyframe.id, *T_world_body, keyframe.scene_depth_m});
  return placed;
}

}  // namespace km
