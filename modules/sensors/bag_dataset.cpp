#include "modules/sensors/bag_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "modules/core/data/imu_limits.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {
namespace {

// Fault of an image that belongs to no frame.
ReaderFault fault_of_unpaired(SensorRole role) {
  if (role == SensorRole::kLeft) return ReaderFault::kLeftWithoutRight;
  return role == SensorRole::kRight ? ReaderFault::kRightWithoutLeft
                                    : ReaderFault::kImageWithoutFrame;
}

// A complete frame waits up to this time, by the log, for inertial samples up to its stamp.
constexpr double kImuPatience_s = 2.0;

// Longest time for which inertial samples and poses wait for a frame.
constexpr double kLongestHeld_s = ImuStream::kLongest_s;

std::size_t index_of(SensorRole role) {
  return static_cast<std::size_t>(role);
}

bool is_inertial(SensorRole role) {
  return role == SensorRole::kImu || role == SensorRole::kGyro || role == SensorRole::kAccel;
}

// " /a, /b", or " none".
std::string names_of(const std::vector<BagChannel>& channels, const SensorKind& kind) {
  std::string names;
  for (const BagChannel& channel : channels)
    if (is_of_kind(channel, kind))
      names += (names.empty() ? " " : ", ") + readable(channel.topic, 80);
  return names.empty() ? " none" : names;
}

ReaderFault fault_of(StampVerdict verdict) {
  if (verdict == StampVerdict::kRepeated) return ReaderFault::kRepeatedStamp;
  return verdict == StampVerdict::kJump ? ReaderFault::kJumpingStamp : ReaderFault::kUnorderedStamp;
}

cv::Size size_of(const StereoRig& rig, std::size_t camera) {
  return {rig.cameras[camera].width, rig.cameras[camera].height};
}

}  // namespace

FrameJoiner::FrameJoiner(bool has_right, bool has_depth) {
  stream_of(SensorRole::kLeft).exists = true;
  stream_of(SensorRole::kRight).exists = has_right;
  stream_of(SensorRole::kDepth).exists = has_depth;
}

void FrameJoiner::drop_oldest(SensorRole role) {
  auto& images = stream_of(role).images;
  report_.add(fault_of_unpaired(role), "stamp " + std::to_string(images.front().stamp));
  images.pop_front();
}

void FrameJoiner::add(SensorRole role, Stamp stamp, BagMessage message) {
  newest_log_time_ = std::max(newest_log_time_, message.log_time);
  auto& images = stream_of(role).images;
  images.push_back({stamp, std::move(message)});
  if (images.size() > kMaxHeld) drop_oldest(role);
}

bool FrameJoiner::has_waited() const {
  return finished_ ||
         seconds_between(left().front().message.log_time, newest_log_time_) > kPatience_s;
}

bool FrameJoiner::knows_synchrony() {
  bool knows_all = true;
  for (const SensorRole role : {SensorRole::kRight, SensorRole::kDepth}) {
    Stream& stream = stream_of(role);
    if (!stream.exists || stream.synchrony) continue;
    const bool suffices =
        left().size() >= kSample && (stream.images.size() >= kSample || has_waited());
    if (!suffices && !finished_) {
      knows_all = false;
      continue;
    }
    std::vector<Stamp> lefts, others;
    for (const Held& image : left()) lefts.push_back(image.stamp);
    for (const Held& image : stream.images) others.push_back(image.stamp);
    stream.synchrony = find_synchrony(lefts, others);
  }
  return knows_all;
}

// Moves the partner of the left image to the front of its stream.
FrameJoiner::Partner FrameJoiner::find_partner(SensorRole role) {
  Stream& stream = stream_of(role);
  if (!stream.exists) return Partner::kNone;
  const Stamp expected = left().front().stamp + nanoseconds(stream.synchrony->offset_s);
  const double tolerance_s = stream.synchrony->tolerance_s;
  while (!stream.images.empty()) {
    const double late_s = seconds_between(expected, stream.images.front().stamp);
    if (std::abs(late_s) <= tolerance_s) return Partner::kThere;
    if (late_s > 0.0) return Partner::kNone;
    drop_oldest(role);
  }
  return has_waited() ? Partner::kNone : Partner::kMayCome;
}

std::optional<JoinedFrame> FrameJoiner::next() {
  while (!left().empty() && knows_synchrony()) {
    const Partner right = find_partner(SensorRole::kRight);
    if (right == Partner::kMayCome) return std::nullopt;
    if (stream_of(SensorRole::kRight).exists && right == Partner::kNone) {
      drop_oldest(SensorRole::kLeft);
      continue;
    }
    const Partner depth = find_partner(SensorRole::kDepth);
    if (depth == Partner::kMayCome) return std::nullopt;
    const auto take = [this](SensorRole role) {
      auto& images = stream_of(role).images;
      BagMessage message = std::move(images.front().message);
      images.pop_front();
      return message;
    };
    JoinedFrame frame{
        .stamp = left().front().stamp, .left = take(SensorRole::kLeft), .right = {}, .depth = {}};
    if (right == Partner::kThere) frame.right = take(SensorRole::kRight);
    if (depth == Partner::kThere) frame.depth = take(SensorRole::kDepth);
    return frame;
  }
  if (finished_ && left().empty())
    for (const SensorRole role : {SensorRole::kRight, SensorRole::kDepth})
      while (!stream_of(role).images.empty()) drop_oldest(role);
  return std::nullopt;
}

BagDataset::BagDataset(std::string name, std::unique_ptr<BagReader> bag, Rig rig,
                       const RecordingPart& window)
    : name_(std::move(name)),
      bag_(std::move(bag)),
      rig_(std::move(rig)),
      window_(window),
      joiner_(!rig_.topics.right.empty(), !rig_.topics.depth.empty()) {
  window_.check(name_);
  find_topics();
  if (is_live()) return;
  first_ = read_packet([](Stamp, Stamp) { return FrameUse::kAll; });
  if (first_) return;
  std::ostringstream message;
  message << name_ << ": no frame with "
          << (gives_poses() ? "a pose of the odometry"
              : has_imu()   ? "inertial samples"
                            : "images of all cameras");
  if (start_ && window.from_s > 0.0) message << " from " << window.from_s << " s";
  if (start_ && std::isfinite(window.to_s)) message << " to " << window.to_s << " s";
  for (const SensorTopic& wanted : sensor_topics(rig_.topics))
    if (taken_[index_of(wanted.kind->role)] == 0)
      message << "; no message on " << readable(wanted.topic, 80);
  refuse(message.str());
}

// Throws DatasetError with the problem and the faults of the bag, which may be the cause.
void BagDataset::refuse(std::string problem) const {
  std::istringstream faults(to_string(report()));
  for (std::string line; std::getline(faults, line);) problem += "; " + line;
  throw DatasetError(problem);
}

void BagDataset::find_topics() {
  kind_of_.assign(bag_->channels().size(), nullptr);
  for (const SensorTopic& wanted : sensor_topics(rig_.topics)) assign(wanted);
  const auto count = [this](SensorRole role) {
    std::uint64_t messages = 0;
    for (std::size_t k = 0; k < kind_of_.size(); ++k)
      if (kind_of_[k] != nullptr && kind_of_[k]->role == role)
        messages += bag_->channels()[k].message_count;
    return messages;
  };
  const bool is_whole = window_.from_s <= 0.0 && std::isinf(window_.to_s) && !window_.not_before;
  if (is_whole) pair_count_ = count(SensorRole::kLeft);
  if (!rig_.topics.right.empty()) pair_count_ = std::min(pair_count_, count(SensorRole::kRight));
}

void BagDataset::assign(const SensorTopic& wanted) {
  const SensorKind& kind = *wanted.kind;
  const auto& channels = bag_->channels();
  bool is_there = false;
  for (std::size_t k = 0; k < channels.size(); ++k) {
    if (channels[k].topic != wanted.topic) continue;
    if (!is_of_kind(channels[k], kind))
      throw DatasetError(
          name_ + ": topic " + readable(wanted.topic, 80) + " has messages of " +
          readable(channels[k].type, 80) + ", not of " +
          (kind.type.empty() ? "sensor_msgs/Image or CompressedImage" : std::string(kind.type)));
    kind_of_[k] = &kind;
    is_there = true;
  }
  if (!is_there)
    refuse(name_ + ": no topic " + readable(wanted.topic, 80) + "; topics with " +
           std::string(kind.content) + ":" + names_of(channels, kind));
}

std::string BagDataset::place_of(const BagMessage& message) const {
  return name_ + ": " + readable(bag_->channels()[message.channel].topic, 80) + " recorded at " +
         std::to_string(message.log_time);
}

bool BagDataset::read_message() {
  if (ended_) return false;
  auto message = bag_->next();
  if (!message) {
    ended_ = true;
    for (std::size_t k = 0; k < doubtful_.size(); ++k)
      for (const Doubtful& one : doubtful_[k]) reject(static_cast<SensorRole>(k), one);
    joiner_.finish();
    return false;
  }
  newest_log_time_ = std::max(newest_log_time_, message->log_time);
  kind_of_.resize(bag_->channels().size(), nullptr);
  const SensorKind* const kind = kind_of_[message->channel];
  if (kind == nullptr) return true;
  ++taken_[index_of(kind->role)];
  take(kind->role, std::move(*message));
  return true;
}

void BagDataset::reject(SensorRole role, const Doubtful& one) {
  const ReaderFault fault = fault_of(one.verdict);
  report_.add(is_inertial(role) ? fault_of_samples(fault) : fault,
              place_of(one.message) + ": stamp " + std::to_string(one.stated));
}

void BagDataset::take(SensorRole role, BagMessage message) {
  const auto header =
      decode_ros<RosHeader>(bag_->channels()[message.channel].encoding, message.bytes);
  if (!header.value)
    return report_.add(
        is_inertial(role) ? ReaderFault::kMalformedSample : ReaderFault::kMalformedMessage,
        place_of(message) + ": " + header.refusal);
  const Stamp stated = header.value->stamp;
  const Stamp stamp = time_.of(index_of(role), stated);
  if (time_.step_s() > 0.0)
    report_.add(ReaderFault::kClockSetBack,
                place_of(message) + ": the clock went back " + fixed(time_.step_s(), 1) + " s to " +
                    std::to_string(stated) + ": later stamps continue the time before");
  const StampVerdict verdict = order_[index_of(role)].judge(stamp);
  auto& doubtful = doubtful_[index_of(role)];
  if (verdict != StampVerdict::kGood) {
    doubtful.push_back({stated, verdict, std::move(message)});
    if (doubtful.size() < StampOrder::kNewTimes) return;
    reject(role, doubtful.front());
    return doubtful.pop_front();
  }
  for (; !doubtful.empty(); doubtful.pop_front()) {
    Doubtful& one = doubtful.front();
    if (const auto time = time_.between(index_of(role), one.stated, stamp))
      take_stamped(role, *time, std::move(one.message));
    else
      reject(role, one);
  }
  take_stamped(role, stamp, std::move(message));
}

void BagDataset::take_stamped(SensorRole role, Stamp stamp, BagMessage message) {
  time_.accept(index_of(role), stamp);
  if (is_inertial(role)) {
    take_imu(role, stamp, message);
    return;
  }
  if (role == SensorRole::kOdometry) {
    take_pose(stamp, message);
    return;
  }
  const ImageGap gap = missing_[index_of(role)].before(stamp);
  if (gap.missing > 0) report_.add(ReaderFault::kMissingBetween, place_of(message), gap.missing);
  if (gap.pause_s > 0.0)
    report_.add(ReaderFault::kPause,
                place_of(message) + ": " + fixed(gap.pause_s, 1) + " s after the one before");
  stamp += nanoseconds(rig_.camera_time_offset_s);
  joiner_.add(role, stamp, std::move(message));
}

void BagDataset::take_pose(Stamp stamp, const BagMessage& message) {
  const auto odometry =
      decode_ros<RosOdometry>(bag_->channels()[message.channel].encoding, message.bytes);
  const auto pose =
      odometry.value ? measured_pose(*odometry.value, rig_.T_child_body) : std::nullopt;
  if (!pose) {
    report_.add(ReaderFault::kMalformedMessage,
                place_of(message) + ": " + (odometry.value ? "no pose" : odometry.refusal));
    return;
  }
  poses_.add(stamp, *pose);
  poses_.drop_before(stamp - nanoseconds(kLongestHeld_s));
}

void BagDataset::take_imu(SensorRole role, Stamp stamp, const BagMessage& message) {
  const auto imu = decode_ros<RosImu>(bag_->channels()[message.channel].encoding, message.bytes);
  if (!imu.value) {
    report_.add(ReaderFault::kMalformedSample, place_of(message) + ": " + imu.refusal);
    return;
  }
  ImuSample sample{stamp, imu.value->angular_velocity, imu.value->linear_acceleration};
  if (role == SensorRole::kGyro) sample.accel.setZero();
  if (role == SensorRole::kAccel) sample.gyro.setZero();
  const bool is_finite = sample.gyro.allFinite() && sample.accel.allFinite();
  if (!is_plausible(sample)) {
    report_.add(is_finite ? ReaderFault::kImplausible : ReaderFault::kNotFinite, place_of(message));
    return;
  }
  if (role == SensorRole::kImu) imu_.add(sample);
  if (role == SensorRole::kGyro) imu_joiner_.add_gyro({stamp, sample.gyro});
  if (role == SensorRole::kAccel) imu_joiner_.add_accel({stamp, sample.accel});
  while (const auto joined = imu_joiner_.next()) imu_.add(*joined);
  imu_.drop_before(stamp - nanoseconds(kLongestHeld_s));
}

std::optional<JoinedFrame> BagDataset::next_frame() {
  auto frame = joiner_.next();
  while (!frame && read_message()) frame = joiner_.next();
  return frame ? frame : joiner_.next();  // at the end of the bag no frame waits any more
}

bool BagDataset::has_imu() const {
  return !rig_.topics.imu.empty() || !rig_.topics.gyro.empty();
}

// True if inertial samples or poses up to the stamp of the frame have arrived.
bool BagDataset::has_motion(const JoinedFrame& frame) {
  if (!gives_poses() && !has_imu()) return true;
  const auto reaches = [&] {
    return gives_poses() ? poses_.reaches(frame.stamp) : imu_.reaches(frame.stamp);
  };
  while (!reaches() && seconds_between(frame.left.log_time, newest_log_time_) < kImuPatience_s &&
         read_message()) {
  }
  const std::string why = gives_poses() ? poses_.why_not(frame.stamp) : imu_.why_not(frame.stamp);
  if (why.empty()) return true;
  report_.add(
      gives_poses() ? ReaderFault::kFrameWithoutPose : ReaderFault::kPairWithoutImu,
      place_of(frame.left) + (gives_poses() ? ": the poses " : ": the inertial samples ") + why);
  return false;
}

std::optional<StereoFrame> BagDataset::decode(const JoinedFrame& joined, FrameUse use) {
  StereoFrame frame;
  frame.stamp = joined.stamp;
  const auto gray = [&](const BagMessage& message, std::size_t camera, GrayImage& image) {
    ImageResult result = gray_of_message(bag_->channels()[message.channel], message,
                                         place_of(message), size_of(rig_.sensors.stereo, camera));
    if (result.fault) report_.add(*result.fault, result.problem);
    image = std::move(result.image);
    return !result.fault;
  };
  if (!gray(joined.left, 0, frame.left)) return std::nullopt;
  if (use == FrameUse::kAll)
    frame.decode_color = [channel = bag_->channels()[joined.left.channel], message = joined.left,
                          size = size_of(rig_.sensors.stereo, 0)] {
      return color_of_message(channel, message, size);
    };
  if (joined.right && !gray(*joined.right, 1, frame.right)) return std::nullopt;
  const bool is_rgbd = rig_.topics.right.empty();
  if (!joined.depth || !rig_.sensors.depth || (use != FrameUse::kAll && !is_rgbd)) return frame;
  DepthResult depth = depth_of_message(bag_->channels()[joined.depth->channel], *joined.depth,
                                       place_of(*joined.depth), size_of(rig_.sensors.stereo, 0),
                                       rig_.depth_scale_m, *rig_.sensors.depth);
  if (!depth.fault)
    frame.depth = std::make_shared<const DepthImage>(std::move(depth.image));
  else
    report_.add(*depth.fault, depth.problem);
  return frame;
}

std::optional<SensorPacket> BagDataset::read_packet(const ChooseUse& choose) {
  while (const auto joined = next_frame()) {
    if (!start_) start_ = last_ = joined->stamp;
    const Stamp step = joined->stamp - std::exchange(last_, joined->stamp);
    if (1e-9 * static_cast<double>(step) > kLongestPause_s) *start_ += step;  // the clock was set
    const double t_s = seconds_between(*start_, joined->stamp);
    if (t_s >= window_.to_s) return std::nullopt;
    if (t_s < window_.from_s || (window_.not_before && joined->stamp < *window_.not_before)) {
      imu_.begin_at(joined->stamp);
      continue;
    }
    if (!has_motion(*joined)) continue;
    const auto pose = gives_poses() ? poses_.at(joined->stamp) : std::nullopt;
    if (gives_poses() && !pose) {
      report_.add(ReaderFault::kFrameWithoutPose, place_of(joined->left) + ": a gap of the poses");
      continue;
    }
    // A live frame may have waited for other messages, so it arrives with the newest message.
    const FrameUse use = choose(joined->stamp, is_live() ? newest_log_time_ : 0);
    if (use == FrameUse::kNone) continue;
    auto frame = decode(*joined, use);
    if (!frame) continue;
    auto samples = has_imu() ? imu_.until(joined->stamp) : std::vector<ImuSample>{};
    imu_.report_gaps(samples, rig_.sensors.imu.rate_hz, name_, report_);
    return SensorPacket{std::make_shared<const StereoFrame>(std::move(*frame)), std::move(samples),
                        pose};
  }
  return std::nullopt;
}

std::optional<SensorPacket> BagDataset::next(const ChooseUse& choose) {
  if (is_over_) return std::nullopt;
  // The first packet is decoded already, so it is used in any case.
  if (first_) (void)choose(first_->frame->stamp, 0);
  std::optional<SensorPacket> packet =
      first_ ? std::exchange(first_, std::nullopt) : read_packet(choose);
  is_over_ = !packet;
  return packet;
}

ReaderReport BagDataset::report() const {
  ReaderReport all = report_;
  all.add(joiner_.report());
  if (imu_joiner_.lost() > 0)
    all.add(ReaderFault::kNoAcceleration, name_ + ": " + rig_.topics.gyro, imu_joiner_.lost());
  const BagReport damage = bag_->report();
  for (const auto& [fault, entry] : damage.entries())
    all.add(fault == BagFault::kLost ? ReaderFault::kLostMessage : ReaderFault::kDamagedBag,
            std::string(to_string(fault)) + ": " + entry.first, entry.count);
  return all;
}

std::vector<std::string> BagDataset::remarks() const {
  std::vector<std::string> lines = rig_.notes;
  const auto add_line = [&](SensorRole role, const char* other) {
    const auto synchrony = joiner_.synchrony(role);
    if (synchrony && is_remarkable(*synchrony)) lines.push_back(to_string(*synchrony, other));
  };
  add_line(SensorRole::kRight, "right");
  add_line(SensorRole::kDepth, "depth");
  return lines;
}

}  // namespace km
