#include "modules/robust/closure_places.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

PoseEdge closure(KeyframeId from, KeyframeId to) {
  return {.from = from, .to = to};
}

SE3 translation(const Eigen::Vector3d& t) {
  return make_pose(Eigen::Matrix3d::Identity(), t);
}

SE3 rotation_z(double angle_rad) {
  return SE3(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()));
}

// Robot 0 moves along x, and robot 1 along y: half a metre for each keyframe.
OdometryPose walk(const KeyframeId& id) {
  const double way_m = 0.5 * id.index;
  const SE3 pose = id.robot == 0 ? translation({way_m, 0.0, 0.0})
                                 : translation({3.0, way_m, 0.0}) * rotation_z(1.0);
  return {.id = id, .T_odom_kf = pose};
}

// A closure between keyframes of robots 0 and 1 by which their odometry lies like this.
Closure closure_for(KeyframeIndex a, KeyframeIndex b, const SE3& T_a_b) {
  const OdometryPose from = walk({0, a}), to = walk({1, b});
  return {from, to, from.T_odom_kf.inverse() * T_a_b * to.T_odom_kf};
}

AlignedOdometry aligned(KeyframeIndex a, KeyframeIndex b, const SE3& T_a_b) {
  return align_odometry(closure_for(a, b, T_a_b));
}

TEST_CASE("A place extends ten keyframes from its first closure, and a row to its last neighbour") {
  std::vector<PoseEdge> closures;
  for (KeyframeIndex k = 0; k < 30; ++k)
    closures.push_back(k % 2 == 0 ? closure({0, 50 + k}, {1, 80 - k})
                                  : closure({1, 80 - k}, {0, 50 + k}));
  CHECK(find_rows(closures).sizes == std::vector<std::size_t>{30});
  CHECK(find_places(closures).sizes == std::vector<std::size_t>{11, 11, 8});
  closures.erase(closures.begin() + 10, closures.begin() + 20);
  CHECK(find_rows(closures).sizes == std::vector<std::size_t>{10, 10});
}

TEST_CASE("Rows join closures that are near each other on both robots") {
  const std::vector<PoseEdge> closures{closure({0, 100}, {1, 200}), closure({0, 110}, {1, 190}),
                                       closure({0, 121}, {1, 190}), closure({0, 100}, {1, 211}),
                                       closure({0, 105}, {2, 200}), closure({0, 100}, {0, 200})};
  const ClosureGroups rows = find_rows(closures);
  CHECK(rows.group_of[0] == rows.group_of[1]);
  CHECK(rows.sizes.size() == 5);
  CHECK(rows.weights() == std::vector<double>{0.5, 0.5, 1.0, 1.0, 1.0, 1.0});
  CHECK(rows.votes() == std::vector<double>(6, 1.0));
}

TEST_CASE("Rows and places depend on neither order, direction nor ids of robots") {
  std::vector<PoseEdge> closures, renamed;
  for (KeyframeIndex k = 0; k < 40; ++k) {
    if (k / 5 % 3 == 2) continue;
    closures.push_back(closure({0, 20 + 2 * k}, {1, 90 - k}));
    renamed.push_back(closure({0, 90 - k}, {1, 20 + 2 * k}));
  }
  std::ranges::reverse(renamed);
  CHECK(first_robot(closures) == 0);
  CHECK(first_robot(renamed) == 1);
  for (const auto find : {find_rows, find_places}) {
    const ClosureGroups groups = find(closures), others = find(renamed);
    REQUIRE(groups.sizes.size() == others.sizes.size());
    for (std::size_t k = 0; k < closures.size(); ++k)
      CHECK(groups.sizes[groups.group_of[k]] ==
            others.sizes[others.group_of[closures.size() - 1 - k]]);
  }
}

TEST_CASE("A closure aligns the odometry of two robots, in either direction") {
  const SE3 T = translation({1.0, 2.0, 3.0}) * rotation_z(0.7);
  Closure closure = closure_for(4, 9, T);
  const AlignedOdometry forward = align_odometry(closure);
  CHECK(forward.T_a_b.isApprox(T, 1e-12));
  CHECK(forward.p_b.isApprox(Eigen::Vector3d(3.0, 4.5, 0.0), 1e-12));
  std::swap(closure.from, closure.to);
  closure.T_from_to = closure.T_from_to.inverse();
  const AlignedOdometry backward = align_odometry(closure);
  CHECK(backward.closure == forward.closure);
  CHECK(backward.T_a_b.isApprox(T, 1e-12));
  CHECK(backward.p_b.isApprox(forward.p_b, 1e-12));
}

TEST_CASE("Closures of several places that agree on another relative pose are rivals") {
  const SE3 aisle = translation({0.0, 3.2, 0.0});
  const SE3 turned = translation({4.0, 1.0, 0.0}) * rotation_z(3.1416);
  std::vector<AlignedOdometry> all{aligned(0, 0, SE3::Identity()), aligned(0, 5, aisle),
                                   aligned(1, 7, aisle),           aligned(20, 22, aisle),
                                   aligned(50, 20, turned),        aligned(70, 1, turned)};
  const std::vector<ClosureId> kept{all.front().closure};
  CHECK(count_rival_rows(all, kept) == 4);
  all.pop_back();
  CHECK(count_rival_rows(all, kept) == 2);
  all.erase(all.begin() + 3);
  CHECK(count_rival_rows(all, kept) == 0);  // one row
  const std::vector<ClosureId> everything{all[0].closure, all[1].closure, all[2].closure,
                                          all[3].closure};
  CHECK(count_rival_rows(all, everything) == 0);
}

TEST_CASE("Closures that err a little, or all differently, are no rivals") {
  CHECK(count_rival_rows({}, {}) == 0);
  const SE3 little = translation({0.9, 0.0, 0.0}), more = translation({1.9, 0.0, 0.0});
  std::vector<AlignedOdometry> all{aligned(20, 20, SE3::Identity()), aligned(15, 20, little),
                                   aligned(25, 25, little)};
  const std::vector<ClosureId> kept{all.front().closure};
  CHECK(count_rival_rows(all, kept) == 0);
  all.push_back(aligned(0, 20, more));
  all.push_back(aligned(35, 25, more));
  CHECK(count_rival_rows(all, kept) == 2);
  std::vector<AlignedOdometry> different;
  for (KeyframeIndex k = 0; k < 80; k += 2)
    different.push_back(aligned(k, k, translation({3.0 + 2.0 * k, 0.0, 0.0})));
  CHECK(count_rival_rows(different, {}) == 0);
}

}  // namespace
}  // namespace km
