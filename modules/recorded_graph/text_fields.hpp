#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "modules/core/config.hpp"
#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/io/text_rows.hpp"

namespace km {

/// Reads the fields of one row in order. Every failure throws std::runtime_error that begins with
/// "file:line: ". Borrows the row and the name of the file.
class TextFields {
 public:
  TextFields(const TextRow& row, const std::string& file) : row_(row), file_(file) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(file_ + ':' + std::to_string(row_.line) + ": " + readable(what));
  }

  [[nodiscard]] bool at_end() const { return next_ == row_.fields.size(); }

  /// The next field; `what` names it in the error if there is none.
  std::string_view text(const char* what) {
    if (at_end()) fail(std::string("line ends before ") + what);
    return row_.fields[next_++];
  }

  /// The next field as a finite number.
  double number(const char* what) {
    const std::string_view field = text(what);
    const auto value = parse_double(field);
    if (!value) fail(std::string(what) + " is not a number: '" + std::string(field) + '\'');
    if (!std::isfinite(*value)) fail(std::string(what) + " is not finite");
    return *value;
  }

  /// The next field as a number within `bounds`.
  double number(const char* what, const Bounds<double>& bounds) {
    const double value = number(what);
    if (!bounds.contains(value))
      fail(std::string(what) + ' ' + shortest_text(value) + " is outside " + bounds.text());
    return value;
  }

  /// The next field as an integer in [0, max].
  std::uint64_t integer(const char* what,
                        std::int64_t max = std::numeric_limits<std::int64_t>::max()) {
    const std::string_view field = text(what);
    const auto value = parse_int64(field);
    if (!value || *value < 0 || *value > max)
      fail(std::string(what) + " is not an integer from 0 to " + std::to_string(max) + ": '" +
           std::string(field) + '\'');
    return static_cast<std::uint64_t>(*value);
  }

  /// The next four fields as a quaternion of unit length, x, y, z, w.
  Eigen::Matrix3d rotation() {
    Eigen::Quaterniond q;
    for (double& c : q.coeffs()) c = number("quaternion");
    if (!(std::abs(q.norm() - 1.0) <= kUnitTolerance))
      fail("quaternion has length " + std::to_string(q.norm()));
    return q.normalized().toRotationMatrix();
  }

 private:
  const TextRow& row_;
  const std::string& file_;
  std::size_t next_ = 0;
};

}  // namespace km
