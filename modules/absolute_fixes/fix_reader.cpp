#include "modules/absolute_fixes/fix_reader.hpp"

#include <bit>
#include <cmath>

#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/io/bytes.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {
namespace {

constexpr double kUsualSigmaOfGnss_m = 3.0, kUsualSigmaOfMotionCapture_m = 0.02;

void check(const AbsoluteFixesConfig& config) {
  const auto require = [](bool ok, const std::string& problem) {
    if (!ok) throw ConfigError("absolute_fixes" + problem);
  };
  require(config.topic.empty() != config.file.empty(),
          ": give either topic or file, for example absolute_fixes.topic=/fix");
  require(config.lever_arm_m.size() == 3, ".lever_arm_m needs three numbers: x, y, z");
  require(config.datum.empty() || config.source == FixSource::kGnss,
          ".datum is for source gnss: remove it");
  require(config.datum.empty() || (config.datum.size() == 3 && std::abs(config.datum[0]) <= 90.0 &&
                                   std::abs(config.datum[1]) <= 180.0),
          ".datum needs latitude, longitude and altitude: [47.3977, 8.5456, 488]");
  require(config.min_sigma_m <= config.max_sigma_m, ".min_sigma_m is above max_sigma_m");
}

// Standard deviation from three variances; nullopt if they state none (0 or negative).
std::optional<double> sigma_of(double x, double y, double z) {
  const double mean = (x + y + z) / 3.0;
  return mean <= 0.0 ? std::nullopt : std::optional(std::sqrt(mean));  // NaN stays NaN
}

std::optional<double> sigma_of(const RosNavSatFix& fix) {
  const auto& P = fix.position_covariance;
  return fix.position_covariance_type == kRosUnknownCovariance ? std::nullopt
                                                               : sigma_of(P[0], P[4], P[8]);
}
std::optional<double> sigma_of(const RosPoseWithCovarianceStamped& pose) {
  return sigma_of(pose.pose.covariance[0], pose.pose.covariance[7], pose.pose.covariance[14]);
}
std::optional<double> sigma_of(const auto& /*pose*/) {
  return std::nullopt;
}

Eigen::Vector3d coordinates_of(const RosNavSatFix& fix) {
  return {fix.latitude, fix.longitude, fix.altitude};
}
Eigen::Vector3d coordinates_of(const RosPoseStamped& pose) {
  return pose.pose.position;
}
Eigen::Vector3d coordinates_of(const RosPoseWithCovarianceStamped& pose) {
  return pose.pose.pose.position;
}
Eigen::Vector3d coordinates_of(const RosTransformStamped& pose) {
  return pose.transform.translation;
}

std::optional<Stamp> stamp_of(const TextRow& row, bool is_csv) {
  if (is_csv) return parse_int64(row.fields.front());
  const auto seconds = parse_double(row.fields.front());
  constexpr double kMost_s = 4e9;
  return seconds && std::abs(*seconds) < kMost_s ? std::optional(nanoseconds(*seconds))
                                                 : std::nullopt;
}

}  // namespace

FixRows read_fix_rows(const std::filesystem::path& file) {
  const std::string text = read_input_file(file);
  FixRows rows;
  for (const TextRow& row : split_rows(text)) {
    const auto stamp = stamp_of(row, file.extension() == ".csv");
    const auto x = number_in(row, 1), y = number_in(row, 2), z = number_in(row, 3);
    if (stamp && x && y && z)
      rows.fixes.push_back({*stamp, {*x, *y, *z}});
    else
      ++rows.malformed;
  }
  return rows;
}

FixReader::FixReader(const AbsoluteFixesConfig& config) : config_(checked(config)) {
  check(config_);
  if (config_.datum.empty()) return;
  datum_ = {config_.datum[0], config_.datum[1], config_.datum[2]};
  enu_.emplace(*datum_);
}

std::uint64_t FixReader::datum_id() const {
  std::uint64_t id = kFnv1aBasis;
  if (config_.source == FixSource::kMotionCapture) return id;
  if (!datum_) return 0;
  for (const double x : {datum_->latitude_deg, datum_->longitude_deg, datum_->altitude_m})
    mix_fnv1a(id, std::bit_cast<std::uint64_t>(x + 0.0));  // -0.0 equals 0.0
  return id;
}

std::optional<TimedPosition> FixReader::accept(const ReceivedFix& fix) {
  const auto& [stamp, coordinates, sigma_m] = fix;
  const bool is_gnss = config_.source == FixSource::kGnss;
  const double usual_m = is_gnss ? kUsualSigmaOfGnss_m : kUsualSigmaOfMotionCapture_m;
  const double claimed_m = sigma_m.value_or(config_.sigma_m.value_or(usual_m));
  const auto refuse = [](std::uint64_t& count) {
    ++count;
    return std::nullopt;
  };
  if (!coordinates.allFinite() || !std::isfinite(claimed_m)) return refuse(counts_.not_finite);
  if (is_gnss && !(std::abs(coordinates.x()) <= 90.0 && std::abs(coordinates.y()) <= 360.0))
    return refuse(counts_.malformed);
  if (!(claimed_m <= config_.max_sigma_m)) return refuse(counts_.too_uncertain);
  if (last_ && stamp <= *last_) return refuse(counts_.out_of_order);
  last_ = stamp;
  TimedPosition accepted{stamp, coordinates, std::max(claimed_m, config_.min_sigma_m)};
  if (is_gnss) {
    const GeodeticPoint point{coordinates.x(), coordinates.y(), coordinates.z()};
    if (!datum_) enu_.emplace(datum_.emplace(point));
    accepted.p_datum = enu_->position_of(point);
  }
  if (!kFix_m.contains(accepted.p_datum.minCoeff()) ||
      !kFix_m.contains(accepted.p_datum.maxCoeff()))
    return refuse(counts_.far_from_datum);
  return accepted;
}

template <typename Message>
std::optional<ReceivedFix> FixReader::decode_as(const BagChannel& channel,
                                                const BagMessage& message) {
  const Decoded<Message> decoded = decode_ros<Message>(channel.encoding, message.bytes);
  if (!decoded.value) {
    ++counts_.malformed;
    return std::nullopt;
  }
  const Message& fix = *decoded.value;
  if constexpr (std::is_same_v<Message, RosNavSatFix>)
    if (fix.status.status < 0) {
      ++counts_.without_position;
      return std::nullopt;
    }
  return ReceivedFix{fix.header.stamp, coordinates_of(fix), sigma_of(fix)};
}

std::optional<ReceivedFix> FixReader::decode(const BagChannel& channel, const BagMessage& message) {
  ++counts_.received;
  if (!has_fixes(channel, config_.source)) {
    ++counts_.malformed;
    return std::nullopt;
  }
  if (is_of_type(channel, RosNavSatFix::kType)) return decode_as<RosNavSatFix>(channel, message);
  if (is_of_type(channel, RosPoseStamped::kType))
    return decode_as<RosPoseStamped>(channel, message);
  if (is_of_type(channel, RosTransformStamped::kType))
    return decode_as<RosTransformStamped>(channel, message);
  return decode_as<RosPoseWithCovarianceStamped>(channel, message);
}

std::vector<TimedPosition> FixReader::read(const std::filesystem::path& file) {
  const FixRows rows = read_fix_rows(file);
  counts_.malformed += rows.malformed;
  counts_.received += rows.malformed + rows.fixes.size();
  std::vector<TimedPosition> fixes;
  for (const ReceivedFix& row : rows.fixes)
    if (const auto fix = accept(row)) fixes.push_back(*fix);
  if (fixes.empty())
    throw InputFileError(file.string() +
                         ": no usable fix in it: rows need a stamp (ns in a .csv file, s "
                         "elsewhere) and three coordinates, at most 40 km from the datum");
  return fixes;
}

std::vector<TimedPosition> FixReader::read(BagReader& bag) {
  std::vector<TimedPosition> fixes;
  while (const auto message = bag.next()) {
    const BagChannel& channel = bag.channels()[message->channel];
    if (channel.topic != config_.topic) continue;
    const auto received = decode(channel, *message);
    if (const auto fix = received ? accept(*received) : std::nullopt) fixes.push_back(*fix);
  }
  if (counts_.received == 0)
    throw InputFileError("the recording has no message on absolute_fixes.topic " + config_.topic +
                         ": --inspect lists its topics");
  if (counts_.received == counts_.malformed)
    throw InputFileError("no message on absolute_fixes.topic " + config_.topic +
                         " is of a type for absolute_fixes.source: gnss reads "
                         "sensor_msgs/NavSatFix, motion_capture geometry_msgs/PoseStamped, "
                         "PoseWithCovarianceStamped and TransformStamped");
  return fixes;
}

bool has_fixes(const BagChannel& channel, FixSource source) {
  if (source == FixSource::kGnss) return is_of_type(channel, RosNavSatFix::kType);
  return source == FixSource::kMotionCapture &&
         (is_of_type(channel, RosPoseStamped::kType) ||
          is_of_type(channel, RosPoseWithCovarianceStamped::kType) ||
          is_of_type(channel, RosTransformStamped::kType));
}

}  // namespace km
