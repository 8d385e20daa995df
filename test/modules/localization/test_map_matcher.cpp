#include "modules/localization/map_matcher.hpp"

#include <Eigen/LU>

#include "modules/place_recognition/vocabulary_training.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kPlaces = 8;
constexpr RobotId kRobot = 3;

// A map of places that look different, and a second view of each.
class World {
 public:
  explicit World(unsigned seed) : rng_(seed) {
    std::vector<std::vector<BinaryDescriptor>> images;
    for (int i = 0; i < kPlaces; ++i) {
      pairs_.push_back(make_keyframe_pair(rng_, 200, {0.7, 0.3}, 1.0));
      images.push_back(pairs_.back().from.descriptors);
      map_.keyframes.push_back({.odometry = {{9, static_cast<KeyframeIndex>(i)}},
                                .stamp = i,
                                .features = pairs_.back().from});
      map_.T_map_kf.push_back(random_pose(rng_, 30.0));
    }
    vocabulary_ =
        std::make_shared<const Vocabulary>(train_vocabulary(images, {.branching = 10, .depth = 3}));
  }

  [[nodiscard]] MapMatcher matcher() const { return {{}, {}, vocabulary_, map_}; }
  [[nodiscard]] const FinishedMap& map() const { return map_; }

  // Keyframe `index` of the robot, which sees `place`; random images elsewhere.
  [[nodiscard]] Keyframe view(KeyframeIndex index, int place) const {
    return {.odometry = {{kRobot, index}}, .features = pairs_[static_cast<std::size_t>(place)].to};
  }
  [[nodiscard]] Keyframe elsewhere(KeyframeIndex index) {
    return {.odometry = {{kRobot, index}},
            .features = make_keyframe_pair(rng_, 200, {0.7, 0.3}, 1.0).to};
  }
  // Pose of view(index, place) relative to the first keyframe of the map.
  [[nodiscard]] SE3 T_0_view(int place) const {
    const auto m = static_cast<std::size_t>(place);
    return map_.T_map_kf[0].inverse() * map_.T_map_kf[m] * pairs_[m].T_from_to;
  }

 private:
  std::mt19937 rng_;
  std::vector<KeyframePair> pairs_;
  FinishedMap map_;
  std::shared_ptr<const Vocabulary> vocabulary_;
};

TEST_CASE("a view of any place of the map gives the pose in the map") {
  World world(GENERATE(1U, 2U, 3U));
  const int place = GENERATE(range(0, kPlaces));
  CAPTURE(place);
  MapMatcher matcher = world.matcher();
  // The first keyframe has no normaliser, so it is not compared.
  CHECK_FALSE(matcher.match(world.view(1, place)).closure);
  const MapMatch match = matcher.match(world.view(2, place));
  REQUIRE(match.closure);
  const Closure& closure = *match.closure;
  CHECK(closure.from.id == KeyframeId{kRobot, 0});
  CHECK(closure.to.id == KeyframeId{kRobot, 2});
  CHECK(closure.from.T_odom_kf.isApprox(world.map().T_map_kf[0]));
  const Vector6 xi = se3_log(closure.T_from_to.inverse() * world.T_0_view(place));
  CHECK(xi.dot(closure.covariance.inverse() * xi) < 22.5);  // 99.9 % of chi-squared
  CHECK(xi.head<3>().norm() < 0.01);
  CHECK(xi.tail<3>().norm() < 0.03);
}

TEST_CASE("other places do not match the map") {
  World world(GENERATE(4U, 5U));
  MapMatcher matcher = world.matcher();
  for (KeyframeIndex i = 1; i < 6; ++i) CHECK_FALSE(matcher.match(world.elsewhere(i)).closure);
}

TEST_CASE("a map without keyframes, or without poses, is refused") {
  World world(6);
  const auto make = [](FinishedMap map) {
    VocabularyData data{.branching = 2,
                        .depth = 1,
                        .children = {2, 0, 0},
                        .centers = {{}, {}, {}},
                        .idf = {1.0F, 1.0F}};
    return MapMatcher({}, {}, std::make_shared<const Vocabulary>(std::move(data)), std::move(map));
  };
  CHECK_THROWS_AS(make({}), std::invalid_argument);
  FinishedMap map = world.map();
  map.T_map_kf.pop_back();
  CHECK_THROWS_AS(make(std::move(map)), std::invalid_argument);
}

}  // namespace
}  // namespace km
