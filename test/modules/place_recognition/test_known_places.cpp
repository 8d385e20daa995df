#include "modules/place_recognition/known_places.hpp"

#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kDepth_m = 4.0;  // near poses are within 0.6 m
constexpr KeyframeIndex kLap = 20;

// A keyframe of a robot that flies a straight lap of 20 m repeatedly, one metre between keyframes.
// Odometry is not aware of the return. Its variance grows by `variance` a keyframe.
OdometryPose keyframe(KeyframeIndex index, double variance = 1e-9) {
  OdometryPose pose;
  pose.id = {7, index};
  pose.T_odom_kf.translation().x() = index;
  pose.covariance = variance * index * Matrix6::Identity();
  return pose;
}

// The closure that finds that keyframe `late` is `offset_m` beyond keyframe `early`.
Closure closure(KeyframeIndex early, KeyframeIndex late, double offset_m = 0.0) {
  Closure closure{
      .from = keyframe(early), .to = keyframe(late), .covariance = 1e-8 * Matrix6::Identity()};
  closure.T_from_to.translation().x() = offset_m;
  return closure;
}

KnownPlaces first_lap() {
  KnownPlaces places;
  for (KeyframeIndex i = 0; i < kLap; ++i) places.add_view(keyframe(i), kDepth_m);
  return places;
}

PlaceNovelty novelty(const KnownPlaces& places, KeyframeIndex index,
                     std::vector<KeyframeIndex> similar) {
  return places.novelty_of(keyframe(index), similar);
}

}  // namespace

TEST_CASE("A closure with a finished map does not replace one inside the run") {
  KnownPlaces places = first_lap();
  places.add_view(keyframe(0), 0.0);  // keyframe 0 is that of the map
  places.add_closure(closure(2, 22));
  places.add_closure(closure(0, 23));
  CHECK(novelty(places, 23, {3}) == PlaceNovelty::kCovered);
}

TEST_CASE("A lap flown again is known from the first closure on, while closures are repeated") {
  KnownPlaces places = first_lap();
  CHECK(novelty(places, 22, {2}) == PlaceNovelty::kNew);  // similar words alone do not suffice
  places.add_closure(closure(2, 22, 0.5));
  const KeyframeIndex fresh = 22 + KnownPlaces::kFreshKeyframes;
  CHECK(novelty(places, 22, {2}) == PlaceNovelty::kCovered);
  CHECK(novelty(places, fresh, {fresh - kLap}) == PlaceNovelty::kCovered);
  CHECK(novelty(places, fresh + 1, {fresh + 1 - kLap}) == PlaceNovelty::kKnown);
  CHECK(novelty(places, 25, {}) == PlaceNovelty::kNew);      // looks different
  CHECK(novelty(places, 25, {4, 7}) == PlaceNovelty::kNew);  // from another pose
  CHECK(novelty(places, 25, {7, 6}) == PlaceNovelty::kCovered);
  CHECK(novelty(places, 41, {21}) == PlaceNovelty::kNew);  // beyond the lap: no view of it
  places.add_closure(closure(19, 39, 0.5));
  CHECK(novelty(places, 45, {6}) == PlaceNovelty::kNew);  // 20 m ahead of keyframe 6 by odometry
  places.add_closure(closure(10, 30, 0.5));               // an older one changes nothing
  CHECK(novelty(places, 39, {19}) == PlaceNovelty::kCovered);
}

TEST_CASE("Without a closure of late a place is new") {
  KnownPlaces places;
  for (KeyframeIndex i = 0; i < 3 * kLap; ++i) places.add_view(keyframe(i), kDepth_m);
  places.add_closure(closure(2, 102));
  const KeyframeIndex last = 102 + KnownPlaces::kValidKeyframes;
  CHECK(novelty(places, last, {last - 100}) == PlaceNovelty::kKnown);
  CHECK(novelty(places, last + 1, {last - 99}) == PlaceNovelty::kNew);
  CHECK(novelty(places, 101, {1}) == PlaceNovelty::kNew);  // before the closure
}

TEST_CASE("A place is new if its pose is far, turned, uncertain or of unknown depth") {
  KnownPlaces places = first_lap();
  places.add_closure(closure(2, 22, 0.59));
  CHECK(novelty(places, 25, {5}) == PlaceNovelty::kCovered);
  places.add_closure(closure(2, 22, 0.61));
  CHECK(novelty(places, 25, {5}) == PlaceNovelty::kNew);

  Closure turned = closure(2, 22);
  turned.T_from_to.linear() =
      Eigen::AngleAxisd(KnownPlaces::kTurn_rad + 0.01, Eigen::Vector3d::UnitX()).toRotationMatrix();
  places.add_closure(turned);
  CHECK(novelty(places, 22, {2}) == PlaceNovelty::kNew);

  places.add_closure(closure(2, 22));
  OdometryPose uncertain = keyframe(25);
  CHECK(places.novelty_of(uncertain, std::vector<KeyframeIndex>{5}) == PlaceNovelty::kCovered);
  uncertain.covariance.diagonal().tail<3>().array() += 0.04;  // three times 0.2 m
  CHECK(places.novelty_of(uncertain, std::vector<KeyframeIndex>{5}) == PlaceNovelty::kNew);

  for (const double unknown_m : {0.0, std::nan("")}) {
    places.add_view(keyframe(5), unknown_m);
    CHECK(novelty(places, 25, {5}) == PlaceNovelty::kNew);
  }
}

TEST_CASE("A closure holds in either direction") {
  KnownPlaces places = first_lap();
  places.add_closure(closure(22, 2, -0.5));
  CHECK(novelty(places, 25, {5}) == PlaceNovelty::kCovered);
}

}  // namespace km
