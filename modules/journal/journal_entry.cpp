#include "modules/journal/journal_entry.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "modules/core/bytes.hpp"
#include "modules/core/covariance.hpp"

namespace km {
namespace {

constexpr std::size_t kMaxText_bytes = 65536;
constexpr std::size_t kMaxKeypoints = 65536;
// Flags of the optional parts after the step of a keyframe.
constexpr unsigned kHasVertical = 1;
constexpr unsigned kHasStateCovariance = 2;
constexpr unsigned kHasCalibration = 4;

class EntryWriter {
 public:
  std::vector<std::uint8_t> operator()(const JournalEntry& entry) {
    out_.u8(static_cast<std::uint8_t>(entry.index()));
    std::visit([this](const auto& value) { put(value); }, entry);
    return out_.release();
  }

 private:
  void put(const JournalStart& start) {
    out_.u16(start.robot);
    out_.u64(start.boot);
    put(start.input);
  }
  void put(const JournalPeer& peer) {
    out_.u16(peer.robot);
    out_.u64(peer.boot);
    put(peer.name);
  }
  void put(const OdometryState& state) {
    put(state.stamp);
    put(state.T_odom_body);
    put(state.v_odom);
    put(state.gyro_bias);
    put(state.accel_bias);
  }
  void put(const KeyframeOdometry& keyframe) {
    put(keyframe.id);
    put(keyframe.stamp);
    put(keyframe.T_odom_kf);
    put(keyframe.T_previous_kf);
    put(keyframe.covariance);
    out_.u8(static_cast<std::uint8_t>((keyframe.vertical ? kHasVertical : 0U) |
                                      (keyframe.state_covariance ? kHasStateCovariance : 0U) |
                                      (keyframe.calibration ? kHasCalibration : 0U)));
    if (keyframe.vertical) {
      put(keyframe.vertical->up_body);
      out_.f64(keyframe.vertical->sigma_rad);
    }
    if (keyframe.state_covariance) put(*keyframe.state_covariance);
    if (!keyframe.calibration) return;
    out_.f64(keyframe.calibration->calibration.offset_s);
    put(keyframe.calibration->calibration.T_body_rig);
    put(keyframe.calibration->covariance);
  }
  void put(const Keyframe& keyframe) {
    put(keyframe.odometry);
    put(keyframe.stamp);
    put(keyframe.features.T_body_cam);
    out_.f64(keyframe.features.focal_px);
    out_.f64(keyframe.features.baseline_m);
    out_.varint(keyframe.features.keypoints.size());
    for (const Keypoint& point : keyframe.features.keypoints) {
      out_.f32(point.bearing.x());
      out_.f32(point.bearing.y());
      out_.f32(point.inverse_depth);
      out_.u8(point.octave);
    }
    for (const OrbDescriptor& descriptor : keyframe.features.descriptors) out_.bytes(descriptor);
  }
  void put(const Closure& closure) {
    put(closure.from);
    put(closure.to);
    put(closure.T_from_to);
    put(closure.covariance);
    out_.u32(static_cast<std::uint32_t>(closure.inliers));
    out_.f64(closure.similarity);
  }
  void put(const ClosureOutcome& outcome) {
    put(outcome.id.from);
    put(outcome.id.to);
    out_.f64(outcome.similarity);
    out_.u8(static_cast<std::uint8_t>(outcome.stage));
    put(outcome.reason);
    out_.u32(static_cast<std::uint32_t>(outcome.matches));
    out_.u32(static_cast<std::uint32_t>(outcome.inliers));
  }
  void put(const OdometryPose& pose) {
    put(pose.id);
    put(pose.T_odom_kf);
    put(pose.covariance);
  }
  void put(const KeyframeId& id) {
    out_.u16(id.robot);
    out_.u32(id.index);
  }
  void put(Stamp stamp) { out_.u64(static_cast<std::uint64_t>(stamp)); }
  void put(const SE3& T) {
    for (int column = 0; column < 4; ++column)
      put(Eigen::Vector3d(T.matrix().block<3, 1>(0, column)));
  }
  void put(const Eigen::Vector3d& v) {
    for (const double value : v) out_.f64(value);
  }
  template <int kSize>
  void put(const Eigen::Matrix<double, kSize, kSize>& covariance) {  // symmetric
    for (int row = 0; row < kSize; ++row)
      for (int column = row; column < kSize; ++column) out_.f64(covariance(row, column));
  }
  void put(const std::string& text) {
    const std::size_t size = std::min(text.size(), kMaxText_bytes);
    out_.varint(size);
    for (std::size_t i = 0; i < size; ++i) out_.u8(static_cast<std::uint8_t>(text[i]));
  }

  ByteWriter out_;
};

class EntryReader {
 public:
  explicit EntryReader(std::span<const std::uint8_t> bytes) : in_(bytes) {}

  std::optional<JournalEntry> operator()() {
    std::optional<JournalEntry> entry = read(in_.u8());
    return in_.done() && finite_ ? std::move(entry) : std::nullopt;
  }

 private:
  template <std::size_t kKind = 0>
  std::optional<JournalEntry> read(std::size_t kind) {
    if constexpr (kKind == std::variant_size_v<JournalEntry>) {
      in_.fail();
      return std::nullopt;
    } else {
      if (kind != kKind) return read<kKind + 1>(kind);
      std::variant_alternative_t<kKind, JournalEntry> value;
      get(value);
      return value;
    }
  }

  void get(JournalStart& start) {
    start.robot = in_.u16();
    start.boot = in_.u64();
    get(start.input);
  }
  void get(JournalPeer& peer) {
    peer.robot = in_.u16();
    peer.boot = in_.u64();
    get(peer.name);
  }
  void get(OdometryState& state) {
    get(state.stamp);
    get(state.T_odom_body);
    get(state.v_odom);
    get(state.gyro_bias);
    get(state.accel_bias);
  }
  void get(KeyframeOdometry& keyframe) {
    get(keyframe.id);
    get(keyframe.stamp);
    get(keyframe.T_odom_kf);
    get(keyframe.T_previous_kf);
    get(keyframe.covariance);
    const unsigned has = in_.u8();
    if ((has & ~(kHasVertical | kHasStateCovariance | kHasCalibration)) != 0) in_.fail();
    if ((has & kHasVertical) != 0) {
      Vertical& vertical = keyframe.vertical.emplace();
      get(vertical.up_body);
      get(vertical.sigma_rad);
    }
    if ((has & kHasStateCovariance) != 0) {
      get(keyframe.state_covariance.emplace());
      if (finite_ && !is_usable(*keyframe.state_covariance)) in_.fail();
    }
    if ((has & kHasCalibration) == 0) return;
    UncertainCalibration& known = keyframe.calibration.emplace();
    get(known.calibration.offset_s);
    get(known.calibration.T_body_rig);
    get(known.covariance);
  }
  void get(Keyframe& keyframe) {
    get(keyframe.odometry);
    get(keyframe.stamp);
    KeyframeFeatures& features = keyframe.features;
    get(features.T_body_cam);
    get(features.focal_px);
    get(features.baseline_m);
    constexpr std::size_t kPoint_bytes = 13;
    features.keypoints.resize(in_.count(kMaxKeypoints, kPoint_bytes + sizeof(OrbDescriptor)));
    features.descriptors.resize(features.keypoints.size());
    for (Keypoint& point : features.keypoints) {
      for (float* const value : {&point.bearing.x(), &point.bearing.y(), &point.inverse_depth}) {
        *value = in_.f32();
        finite_ &= std::isfinite(*value);
      }
      point.octave = in_.u8();
    }
    for (OrbDescriptor& descriptor : features.descriptors) {
      const auto bytes = in_.bytes(descriptor.size());
      std::copy(bytes.begin(), bytes.end(), descriptor.begin());
    }
  }
  void get(Closure& closure) {
    get(closure.from);
    get(closure.to);
    get(closure.T_from_to);
    get(closure.covariance);
    closure.inliers = static_cast<int>(in_.u32());
    get(closure.similarity);
  }
  void get(ClosureOutcome& outcome) {
    get(outcome.id.from);
    get(outcome.id.to);
    get(outcome.similarity);
    const std::uint8_t stage = in_.u8();
    if (stage > static_cast<std::uint8_t>(ClosureStage::kInlier)) in_.fail();
    outcome.stage = static_cast<ClosureStage>(stage);
    get(outcome.reason);
    outcome.matches = static_cast<int>(in_.u32());
    outcome.inliers = static_cast<int>(in_.u32());
  }
  void get(OdometryPose& pose) {
    get(pose.id);
    get(pose.T_odom_kf);
    get(pose.covariance);
  }
  void get(KeyframeId& id) {
    id.robot = in_.u16();
    id.index = in_.u32();
  }
  void get(Stamp& stamp) { stamp = static_cast<Stamp>(in_.u64()); }
  void get(double& value) {
    value = in_.f64();
    finite_ &= std::isfinite(value);
  }
  void get(SE3& T) {
    for (int column = 0; column < 4; ++column) {
      Eigen::Vector3d v;
      get(v);
      T.matrix().block<3, 1>(0, column) = v;
    }
  }
  void get(Eigen::Vector3d& v) {
    for (double& value : v) get(value);
  }
  template <int kSize>
  void get(Eigen::Matrix<double, kSize, kSize>& covariance) {
    for (int row = 0; row < kSize; ++row)
      for (int column = row; column < kSize; ++column) {
        get(covariance(row, column));
        covariance(column, row) = covariance(row, column);
      }
  }
  void get(std::string& text) {
    const auto bytes = in_.bytes(in_.count(kMaxText_bytes, 1));
    text.assign(bytes.begin(), bytes.end());
  }

  ByteReader in_;
  bool finite_ = true;
};

}  // namespace

std::vector<std::uint8_t> encode_journal_entry(const JournalEntry& entry) {
  return EntryWriter()(entry);
}

Decoded<JournalEntry> decode_journal_entry(std::span<const std::uint8_t> bytes) {
  auto entry = EntryReader(bytes)();
  if (!entry) return Decoded<JournalEntry>::refuse("not an entry of a journal");
  return Decoded<JournalEntry>::accept(*std::move(entry));
}

}  // namespace km
