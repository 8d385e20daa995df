#include "modules/view/view_update.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "modules/core/bytes.hpp"

namespace km {
namespace {

constexpr double kUnitTolerance = 1e-3;    // Tolerance for the length of a quaternion.
constexpr double kMaxTranslation_m = 1e7;  // Maximum distance of a robot from the origin of a
                                           // frame.
constexpr std::size_t kPoseBytes = 7 * sizeof(float);

// Minimum bytes of one element of each list.
constexpr std::size_t kLinkBytes = 1 + sizeof(float);
constexpr std::size_t kNumberBytes = 1 + sizeof(double);
constexpr std::size_t kClosureBytes = 4 + 1 + 1 + 1 + 1;
constexpr std::size_t kFeatureBytes = 2 * sizeof(float);
constexpr std::size_t kTripleBytes = 3 * sizeof(std::uint16_t);

bool is_printable(char c) {
  return c >= ' ' && c <= '~';
}

class ContentWriter {
 public:
  std::vector<std::uint8_t> content(const ViewContent& content) {
    out_.u8(static_cast<std::uint8_t>(content.index()));
    std::visit([this](const auto& c) { put(c); }, content);
    if (out_.size() > kMaxViewBytes)
      throw std::length_error("view: content of kind " + std::to_string(content.index()) + " has " +
                              std::to_string(out_.size()) + " B, at most " +
                              std::to_string(kMaxViewBytes) + " are allowed");
    return out_.release();
  }

 private:
  void put(const ViewState& s) {
    put(s.name);
    put(s.phase);
    out_.f64(s.dataset_time_s);
    out_.varint(s.keyframes);
    out_.varint(s.skipped_frames);
    out_.varint(s.anchor);
    out_.u8(s.tentative ? 1 : 0);
    out_.varint(s.round);
    for (const double value : {s.cost, s.gradient_norm, s.cpu_s, s.resident_MB}) out_.f64(value);
    put_all(s.links, [this](const ViewLink& link) {
      out_.varint(link.robot);
      out_.f32(link.silent_s);
    });
    for (const auto* numbers : {&s.sent_bytes, &s.loads})
      put_all(*numbers, [this](const ViewNumber& number) {
        put(number.name);
        out_.f64(number.value);
      });
  }

  void put(const ViewPose& pose) {
    out_.u64(static_cast<std::uint64_t>(pose.stamp));
    put(pose.T_odom_body);
  }

  void put(const ViewKeyframes& keyframes) {
    out_.u8(keyframes.optimized ? 1 : 0);
    out_.varint(keyframes.anchor);
    out_.varint(keyframes.first);
    put_all(keyframes.T_world_kf, [this](const SE3& T) { put(T); });
    for (const Stamp stamp : keyframes.stamps) out_.u64(static_cast<std::uint64_t>(stamp));
  }

  void put(const ViewClosures& closures) {
    put_all(closures.closures, [this](const ViewClosure& closure) {
      for (const KeyframeId& end : {closure.id.from, closure.id.to}) {
        out_.varint(end.robot);
        out_.varint(end.index);
      }
      out_.u8(static_cast<std::uint8_t>(closure.verdict));
      out_.varint(closure.matches);
      out_.varint(closure.inliers);
      put(closure.reason);
    });
  }

  void put(const MeshChunk& chunk) {
    for (const std::int32_t c : chunk.key.cell) out_.u32(static_cast<std::uint32_t>(c));
    out_.varint(chunk.key.part);
    out_.varint(chunk.anchor);
    out_.f32(chunk.step_m);
    for (const std::int32_t c : chunk.origin) out_.u32(static_cast<std::uint32_t>(c));
    put_all(chunk.offsets, [this](const MeshChunk::Triple& triple) { put(triple); });
    out_.varint(chunk.labels.size());
    out_.bytes(chunk.labels);
    put_all(chunk.faces, [this](const MeshChunk::Triple& triple) { put(triple); });
  }

  void put(const ViewImage& image) {
    out_.u64(static_cast<std::uint64_t>(image.stamp));
    out_.varint(image.jpeg.size());
    out_.bytes(image.jpeg);
    put_all(image.features, [this](const std::array<float, 2>& feature) {
      for (const float c : feature) out_.f32(c);
    });
  }

  void put(const std::string& text) {
    out_.varint(text.size());
    for (const char c : text) out_.u8(static_cast<std::uint8_t>(is_printable(c) ? c : '?'));
  }
  void put(const SE3& T) {
    const Eigen::Quaterniond q(T.linear());
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) out_.f32(static_cast<float>(value));
    for (const double value : T.translation()) out_.f32(static_cast<float>(value));
  }
  void put(const MeshChunk::Triple& triple) {
    for (const std::uint16_t value : triple) out_.u16(value);
  }

  template <typename T, typename Put>
  void put_all(const std::vector<T>& list, const Put& put_one) {
    out_.varint(list.size());
    for (const T& element : list) put_one(element);
  }

  ByteWriter out_;
};

// After a failed check the reader is in the state of failure and returns zeros and empty lists.
class ContentReader {
 public:
  explicit ContentReader(std::span<const std::uint8_t> bytes) : in_(bytes) {}

  std::optional<ViewContent> content() {
    ViewContent content = any();
    return in_.done() ? std::optional(std::move(content)) : std::nullopt;
  }

 private:
  // Kinds are numbered in the order of ViewContent.
  ViewContent any() {
    switch (in_.u8()) {
      case 0:
        return state();
      case 1:
        return live_pose();
      case 2:
        return keyframes();
      case 3:
        return closures();
      case 4:
        return chunk();
      case 5:
        return image();
      default:
        in_.fail();
        return {};
    }
  }

  bool flag() {
    const std::uint8_t value = in_.u8();
    require(value <= 1);
    return value == 1;
  }

  ViewState state() {
    ViewState s;
    s.name = text();
    s.phase = text();
    s.dataset_time_s = finite();
    s.keyframes = in_.varint_as<std::uint32_t>();
    s.skipped_frames = in_.varint_as<std::uint32_t>();
    s.anchor = in_.varint_as<RobotId>();
    s.tentative = flag();
    s.round = in_.varint_as<std::uint32_t>();
    for (double* value : {&s.cost, &s.gradient_norm, &s.cpu_s, &s.resident_MB}) *value = finite();
    get_all(s.links, kLinkBytes, [this](ViewLink& link) {
      link.robot = in_.varint_as<RobotId>();
      link.silent_s = finite_float();
    });
    for (auto* numbers : {&s.sent_bytes, &s.loads})
      get_all(*numbers, kNumberBytes, [this](ViewNumber& number) {
        number.name = text();
        number.value = finite();
      });
    return s;
  }

  ViewPose live_pose() {
    ViewPose result;
    result.stamp = static_cast<Stamp>(in_.u64());
    result.T_odom_body = pose();
    return result;
  }

  ViewKeyframes keyframes() {
    ViewKeyframes result;
    result.optimized = flag();
    result.anchor = in_.varint_as<RobotId>();
    result.first = in_.varint_as<KeyframeIndex>();
    get_all(result.T_world_kf, kPoseBytes, [this](SE3& T) { T = pose(); });
    if (!result.optimized) result.stamps.resize(result.T_world_kf.size());
    for (Stamp& stamp : result.stamps) stamp = static_cast<Stamp>(in_.u64());
    return result;
  }

  ViewClosures closures() {
    ViewClosures result;
    get_all(result.closures, kClosureBytes, [this](ViewClosure& closure) {
      for (KeyframeId* end : {&closure.id.from, &closure.id.to}) {
        end->robot = in_.varint_as<RobotId>();
        end->index = in_.varint_as<KeyframeIndex>();
      }
      require(!(closure.id.to < closure.id.from));
      closure.verdict = static_cast<ViewVerdict>(in_.u8());
      require(closure.verdict <= ViewVerdict::kRejected);
      closure.matches = in_.varint_as<std::uint16_t>();
      closure.inliers = in_.varint_as<std::uint16_t>();
      closure.reason = text();
    });
    return result;
  }

  MeshChunk chunk() {
    MeshChunk result;
    for (std::int32_t& c : result.key.cell) c = static_cast<std::int32_t>(in_.u32());
    result.key.part = in_.varint_as<std::uint16_t>();
    result.anchor = in_.varint_as<RobotId>();
    result.step_m = in_.f32();
    for (std::int32_t& c : result.origin) c = static_cast<std::int32_t>(in_.u32());
    const auto get = [this](MeshChunk::Triple& triple) {
      for (std::uint16_t& value : triple) value = in_.u16();
    };
    get_all(result.offsets, kTripleBytes, get);
    get_all(result.labels, 1, [this](LabelId& label) { label = in_.u8(); });
    get_all(result.faces, kTripleBytes, get);
    require(fault_of(result) == nullptr);
    return result;
  }

  ViewImage image() {
    ViewImage result;
    result.stamp = static_cast<Stamp>(in_.u64());
    const auto jpeg = in_.bytes(in_.count(kMaxViewBytes, 1));
    result.jpeg.assign(jpeg.begin(), jpeg.end());
    get_all(result.features, kFeatureBytes, [this](std::array<float, 2>& feature) {
      for (float& c : feature) c = finite_float();
    });
    return result;
  }

  std::string text() {
    const auto bytes = in_.bytes(in_.count(kMaxViewBytes, 1));
    std::string result(bytes.begin(), bytes.end());
    require(std::ranges::all_of(result, is_printable));
    return result;
  }
  double finite() {
    const double value = in_.f64();
    require(std::isfinite(value));
    return value;
  }
  float finite_float() {
    const float value = in_.f32();
    require(std::isfinite(value));
    return value;
  }
  SE3 pose() {
    const float x = in_.f32(), y = in_.f32(), z = in_.f32(), w = in_.f32();
    const Eigen::Quaterniond q = Eigen::Quaternionf(w, x, y, z).cast<double>();
    Eigen::Vector3d t;
    for (double& value : t) value = static_cast<double>(in_.f32());
    // The comparison is false for NaN, so NaN fails.
    const bool is_pose = std::abs(q.norm() - 1.0) <= kUnitTolerance && t.allFinite() &&
                         t.cwiseAbs().maxCoeff() <= kMaxTranslation_m;
    require(is_pose);
    return is_pose ? make_pose(q.normalized().toRotationMatrix(), t) : SE3::Identity();
  }

  void require(bool condition) {
    if (!condition) in_.fail();
  }

  template <typename T, typename Get>
  void get_all(std::vector<T>& list, std::size_t least_bytes, const Get& get_one) {
    list.resize(in_.count(kMaxViewBytes, least_bytes));
    for (T& element : list) get_one(element);
  }

  ByteReader in_;
};

}  // namespace

std::vector<std::uint8_t> encode_view(const ViewContent& content) {
  return ContentWriter().content(content);
}

std::optional<ViewContent> decode_view(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kMaxViewBytes) return std::nullopt;
  return ContentReader(bytes).content();
}

}  // namespace km
