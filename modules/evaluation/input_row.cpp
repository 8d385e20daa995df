#include "modules/evaluation/input_row.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "modules/core/config.hpp"
#include "modules/core/io/input_file.hpp"

namespace km {

void InputRow::fail(const std::string& why) const {
  throw InputFileError(file_ + " line " + std::to_string(row_.line) + ": " + readable(why));
}

double InputRow::number(std::size_t i) const {
  const auto value = parse_double(text(i));
  if (!value || !std::isfinite(*value))
    fail(std::string(text(i)) + " is not a finite number" +
         (text(i).find(' ') != std::string_view::npos ? "; are there decimal commas?" : ""));
  return *value;
}

std::int64_t InputRow::integer(std::size_t i, std::int64_t max) const {
  const auto value = parse_int64(text(i));
  if (!value || *value < 0 || *value > max)
    fail(std::string(text(i)) + " is not a number from 0 to " + std::to_string(max));
  return *value;
}

SE3 InputRow::pose(std::size_t i, bool w_first) const {
  constexpr double kMaxNormError = 0.01;
  const Eigen::Vector3d t(number(i), number(i + 1), number(i + 2));
  const Eigen::Vector4d v(number(i + 3), number(i + 4), number(i + 5), number(i + 6));
  const Eigen::Quaterniond q =
      w_first ? Eigen::Quaterniond(v[0], v[1], v[2], v[3]) : Eigen::Quaterniond(v);
  if (std::abs(q.norm() - 1.0) > kMaxNormError)
    fail("the quaternion's norm is " + std::to_string(q.norm()));
  for (const double coordinate : t)
    if (std::abs(coordinate) > kMaxInput_m)
      fail("a coordinate of " + shortest_text(coordinate) + " m is beyond " +
           shortest_text(kMaxInput_m));
  return make_pose(q.normalized().toRotationMatrix(), t);
}

}  // namespace km
