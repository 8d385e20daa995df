#include "modules/sensors/static_transforms.hpp"

#include <cmath>
#include <deque>
#include <utility>

#include "modules/core/lie.hpp"
#include "modules/core/text_rows.hpp"

namespace km {
namespace {

constexpr double kMaxNormError = 1e-3;  // norm of a quaternion

std::string plain(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

}  // namespace

void StaticTransforms::add(const RosTFMessage& message) {
  for (const RosTransformStamped& transform : message.transforms) {
    const Eigen::Quaterniond& q = transform.transform.rotation;
    if (!(std::abs(q.norm() - 1.0) < kMaxNormError) || !transform.transform.translation.allFinite())
      continue;
    const SE3 T = make_pose(q.normalized().toRotationMatrix(), transform.transform.translation);
    const std::string parent = plain(transform.header.frame_id),
                      child = plain(transform.child_frame_id);
    T_a_b_[parent].insert_or_assign(child, T);
    T_a_b_[child].insert_or_assign(parent, T.inverse());
  }
}

std::optional<SE3> StaticTransforms::find(const std::string& a, const std::string& b) const {
  std::map<std::string, SE3> found = {{plain(a), SE3::Identity()}};  // T_a_frame
  std::deque<std::string> next = {plain(a)};
  for (; !next.empty() && !found.contains(plain(b)); next.pop_front()) {
    const auto neighbours = T_a_b_.find(next.front());
    if (neighbours == T_a_b_.end()) continue;
    const SE3 T_a_frame = found.at(next.front());
    for (const auto& [frame, T] : neighbours->second)
      if (found.emplace(frame, T_a_frame * T).second) next.push_back(frame);
  }
  const auto last = found.find(plain(b));
  return last == found.end() ? std::nullopt : std::optional(last->second);
}

std::string StaticTransforms::frames() const {
  std::string names;
  for (const auto& [frame, neighbours] : T_a_b_)
    names += (names.empty() ? "" : ", ") + readable(frame, 80);
  return names.empty() ? "none" : names;
}

}  // namespace km
