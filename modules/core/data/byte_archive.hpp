#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/io/bytes.hpp"
#include "modules/core/stamp.hpp"

namespace km {

// One function describes a type for writing and for reading:
//   void describe(auto& archive, As<OdometryPose> auto& pose) {
//     archive(pose.id, pose.T_odom_kf, pose.covariance);
//   }
// The archive is an ArchiveWriter, and the value constant, or an ArchiveReader, which assigns it.
// An archive also takes values of types that have such a function.

/// T, constant or not.
template <typename T, typename U>
concept As = std::same_as<std::remove_const_t<T>, U>;

/// True if the archive assigns the values that it is given.
template <typename Archive>
inline constexpr bool kReads = std::remove_reference_t<Archive>::kReads;

[[nodiscard]] constexpr bool is_printable(char c) {
  return c >= ' ' && c <= '~';
}

/// Writes the described values. Unsigned numbers are varints, all others have a fixed size.
class ArchiveWriter {
 public:
  static constexpr bool kReads = false;

  template <typename... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }
  void fixed(std::uint16_t value) { out_.u16(value); }
  void fixed(std::int32_t value) { out_.u32(static_cast<std::uint32_t>(value)); }
  void fixed(std::uint64_t value) { out_.u64(value); }
  /// An enumerator from 0 to `last`.
  template <typename Enum>
  void choice(Enum value, Enum /*last*/) {
    out_.u8(static_cast<std::uint8_t>(value));
  }
  /// A text of printable ASCII; any other character becomes '?'.
  void printable(const std::string& text) {
    out_.varint(text.size());
    for (const char c : text) out_.u8(static_cast<std::uint8_t>(is_printable(c) ? c : '?'));
  }
  /// The number of the elements that follow: up to `most`, of at least `least_bytes` each.
  void count(std::size_t elements, std::size_t /*most*/, std::size_t /*least_bytes*/) {
    out_.varint(elements);
  }
  /// Up to `most` elements of at least `least_bytes` each.
  template <typename T, typename Each>
  void list(const std::vector<T>& values, std::size_t /*most*/, std::size_t /*least_bytes*/,
            const Each& each) {
    out_.varint(values.size());
    for (const T& value : values) each(value);
  }
  template <typename T>
  void list(const std::vector<T>& values, std::size_t /*most*/, std::size_t /*least_bytes*/) {
    out_.varint(values.size());
    for (const T& value : values) put(value);
  }
  /// Up to eight flags in a byte.
  void flags(std::same_as<bool> auto... values) {
    unsigned byte = 0, bit = 0;
    ((byte |= (values ? 1U : 0U) << bit++), ...);
    out_.u8(static_cast<std::uint8_t>(byte));
  }
  /// All bytes up to the end.
  void rest(std::span<const std::uint8_t> bytes) { out_.bytes(bytes); }
  template <typename T, typename Each>
  void optional(const std::optional<T>& value, const Each& each) {
    put(value.has_value());
    if (value) each(*value);
  }
  /// The number of the alternative, then its value.
  template <typename... T, typename Each>
  void alternative(const std::variant<T...>& value, const Each& each) {
    out_.u8(static_cast<std::uint8_t>(value.index()));
    std::visit(each, value);
  }
  void require(bool /*condition*/) {}

  [[nodiscard]] std::size_t size() const { return out_.size(); }
  [[nodiscard]] std::vector<std::uint8_t> release() { return out_.release(); }

 private:
  void put(bool value) { out_.u8(value ? 1 : 0); }
  void put(std::uint8_t value) { out_.u8(value); }
  void put(std::int8_t value) { out_.u8(static_cast<std::uint8_t>(value)); }
  void put(std::unsigned_integral auto value) { out_.varint(value); }
  void put(int value) { out_.u32(static_cast<std::uint32_t>(value)); }
  void put(Stamp value) { out_.u64(static_cast<std::uint64_t>(value)); }
  template <typename T>
  requires requires(ArchiveWriter& archive, const T& value) { describe(archive, value); }
  void put(const T& value) { describe(*this, value); }
  void put(float value) { out_.f32(value); }
  void put(double value) { out_.f64(value); }
  void put(const KeyframeId& id) { (*this)(id.robot, id.index); }
  void put(const std::string& text) {
    out_.varint(text.size());
    for (const char c : text) out_.u8(static_cast<std::uint8_t>(c));
  }
  void put(const SE3& T) {
    for (int column = 0; column < 4; ++column)
      put(Eigen::Vector3d(T.matrix().block<3, 1>(0, column)));
  }
  template <typename Scalar, int kRows>
  void put(const Eigen::Matrix<Scalar, kRows, 1>& vector) {
    for (const Scalar value : vector) put(value);
  }
  template <int kSize>
  void put(const Eigen::Matrix<double, kSize, kSize>& symmetric) {
    for (int row = 0; row < kSize; ++row)
      for (int column = row; column < kSize; ++column) out_.f64(symmetric(row, column));
  }

  ByteWriter out_;
};

/// Reads the bytes of an ArchiveWriter without trusting them. After the first impossible value it
/// has failed and assigns zeros and empty lists. Numbers that are not finite, and transforms that
/// are not rigid, are impossible. The bytes must outlive the archive.
class ArchiveReader {
 public:
  static constexpr bool kReads = true;

  explicit ArchiveReader(std::span<const std::uint8_t> bytes) : in_(bytes) {}

  template <typename... T>
  void operator()(T&... values) {
    (get(values), ...);
  }
  void fixed(std::uint16_t& value) { value = in_.u16(); }
  void fixed(std::int32_t& value) { value = static_cast<std::int32_t>(in_.u32()); }
  void fixed(std::uint64_t& value) { value = in_.u64(); }
  template <typename Enum>
  void choice(Enum& value, Enum last) {
    value = static_cast<Enum>(in_.u8());
    require(value <= last);
  }
  void printable(std::string& text) {
    get(text);
    require(std::ranges::all_of(text, is_printable));
  }
  void count(std::size_t& elements, std::size_t most, std::size_t least_bytes) {
    elements = in_.count(most, least_bytes);
  }
  template <typename T, typename Each>
  void list(std::vector<T>& values, std::size_t most, std::size_t least_bytes, const Each& each) {
    values.resize(in_.count(most, least_bytes));
    for (T& value : values) each(value);
  }
  template <typename T>
  void list(std::vector<T>& values, std::size_t most, std::size_t least_bytes) {
    list(values, most, least_bytes, [this](T& value) { get(value); });
  }
  void flags(std::same_as<bool> auto&... values) {
    unsigned byte = in_.u8();
    ((values = (byte & 1U) != 0, byte >>= 1U), ...);
    require(byte == 0);
  }
  [[nodiscard]] std::span<const std::uint8_t> rest() { return in_.bytes(in_.left()); }
  template <typename T, typename Each>
  void optional(std::optional<T>& value, const Each& each) {
    bool has = false;
    get(has);
    if (has) each(value.emplace());
  }
  template <typename... T, typename Each>
  void alternative(std::variant<T...>& value, const Each& each) {
    const std::size_t number = in_.u8();
    std::size_t k = 0;
    const bool found = ((k++ == number && (each(value.template emplace<T>()), true)) || ...);
    require(found);
  }
  void require(bool condition) {
    if (!condition) in_.fail();
  }

  /// True if all bytes were read and no value was impossible.
  [[nodiscard]] bool done() const { return in_.done(); }
  [[nodiscard]] bool failed() const { return in_.failed(); }
  [[nodiscard]] std::size_t left() const { return in_.left(); }

 private:
  void get(bool& value) {
    const std::uint8_t byte = in_.u8();
    require(byte <= 1);
    value = byte == 1;
  }
  void get(std::uint8_t& value) { value = in_.u8(); }
  void get(std::int8_t& value) { value = static_cast<std::int8_t>(in_.u8()); }
  template <std::unsigned_integral T>
  void get(T& value) {
    value = in_.varint_as<T>();
  }
  void get(int& value) { value = static_cast<int>(in_.u32()); }
  void get(Stamp& value) { value = static_cast<Stamp>(in_.u64()); }
  template <typename T>
  requires requires(ArchiveReader& archive, T& value) { describe(archive, value); }
  void get(T& value) { describe(*this, value); }
  void get(float& value) { value = finite(in_.f32()); }
  void get(double& value) { value = finite(in_.f64()); }
  void get(KeyframeId& id) { (*this)(id.robot, id.index); }
  void get(std::string& text) {
    constexpr std::size_t kMaxText_bytes = 65536;
    const auto bytes = in_.bytes(in_.count(kMaxText_bytes, 1));
    text.assign(bytes.begin(), bytes.end());
  }
  void get(SE3& T) {
    T = SE3::Identity();
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row) get(T.matrix()(row, column));
    require(is_rigid(T, kUnitTolerance) && kPosition_m.contains(T.translation().minCoeff()) &&
            kPosition_m.contains(T.translation().maxCoeff()));
  }
  template <typename Scalar, int kRows>
  void get(Eigen::Matrix<Scalar, kRows, 1>& vector) {
    for (Scalar& value : vector) get(value);
  }
  template <int kSize>
  void get(Eigen::Matrix<double, kSize, kSize>& symmetric) {
    for (int row = 0; row < kSize; ++row)
      for (int column = row; column < kSize; ++column) {
        get(symmetric(row, column));
        symmetric(column, row) = symmetric(row, column);
      }
  }
  template <typename T>
  T finite(T value) {
    require(std::isfinite(value));
    return std::isfinite(value) ? value : T();
  }

  ByteReader in_;
};

}  // namespace km
