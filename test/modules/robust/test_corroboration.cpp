#include "modules/core/geometry/lie.hpp"
#include "modules/robust/corroboration.hpp"
#include "modules/robust/robust_schedule.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kKeyframes = 300;
constexpr double kSigma = 0.01;  // [rad], [m]
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

// Two robots drive side by side, and each keyframe of one robot sees a keyframe of the other.
class Lanes {
 public:
  // The noise of odometry is `times` its claimed noise.
  Lanes(int dimension, double times, unsigned seed, double step_sigma = kSigma)
      : dimension_(dimension), rng_(seed), precision_(claim(kSigma)) {
    step_ = {{kOne, claim(step_sigma)}, {kOther, claim(step_sigma)}};
    for (int lane = 0; lane < 2; ++lane) {
      SE3 odometry = truth(lane, 0);
      for (int k = 0; k < kKeyframes; ++k) {
        if (k > 0)
          odometry =
              odometry * truth(lane, k - 1).inverse() * truth(lane, k) * noise(times * step_sigma);
        poses_[id(lane, k)] = odometry;
      }
    }
  }

  void add_true(int k, int l, double times = 1.0) {
    closures_.push_back({id(0, k), id(1, l),
                         truth(0, k).inverse() * truth(1, l) * noise(times * kSigma), precision_});
  }
  // A random relative pose, or one with a small rotation error.
  void add_false(int k, int l, bool turned = true) {
    SE3 T = truth(0, k).inverse() * truth(1, l);
    T = T * se3_exp(flat((turned ? 20.0 : 0.2) * random_vector<6>(rng_)));
    T.translation() += flat(20.0 * random_vector<6>(rng_)).tail<3>();
    closures_.push_back({id(0, k), id(1, l), T, precision_});
  }
  void add_random_false(int count, bool turned = true) {
    std::uniform_int_distribution<int> keyframe(0, kKeyframes - 1);
    for (int n = 0; n < count; ++n) {
      const int k = keyframe(rng_);
      const int l = keyframe(rng_);
      if (k != l) add_false(k, l, turned);
    }
  }
  [[nodiscard]] std::vector<PoseEdge>& closures() { return closures_; }

  [[nodiscard]] std::optional<NoiseScale> noise_scale(std::size_t most = 300) const {
    NoiseHistogram lengths;
    const Corroboration::PoseOf pose = [this](const KeyframeId& k) { return poses_.at(k); };
    Corroboration(closures_, pose, step_, dimension_, later_runs_).count_lengths(lengths, most);
    return fit_noise(lengths, dimension_);
  }
  // Cycles through two true closures and at most 10 steps of odometry.
  [[nodiscard]] std::size_t true_cycles() const {
    const auto steps = [](const KeyframeId& a, const KeyframeId& b) {
      return std::max(a.index, b.index) - std::min(a.index, b.index);
    };
    std::size_t count = 0;
    for (std::size_t a = 0; a < closures_.size(); ++a)
      for (std::size_t b = a + 1; b < closures_.size(); ++b) {
        const PoseEdge& one = closures_[a];
        const PoseEdge& other = closures_[b];
        if (one.from.index == one.to.index && other.from.index == other.to.index &&
            steps(one.from, other.from) + steps(one.to, other.to) <= 10)
          ++count;
      }
    return count;
  }
  [[nodiscard]] std::set<ClosureId> isolated(const std::vector<PoseEdge>& closures) const {
    const Corroboration::PoseOf pose = [this](const KeyframeId& k) { return poses_.at(k); };
    const std::vector<bool> alone = Corroboration(closures, pose, step_, dimension_, later_runs_)
                                        .isolated(default_threshold(dimension_));
    REQUIRE(alone.size() == closures.size());
    std::set<ClosureId> ids;
    for (std::size_t k = 0; k < alone.size(); ++k)
      if (alone[k]) ids.insert(closures[k].id());
    return ids;
  }
  [[nodiscard]] std::set<ClosureId> isolated() const { return isolated(closures_); }
  // Those that drift may explain if the closures up to keyframe `last_kept` of the first robot are
  // kept.
  [[nodiscard]] std::set<ClosureId> possible(const std::vector<PoseEdge>& closures,
                                             KeyframeIndex last_kept) const {
    const Corroboration::PoseOf pose = [this](const KeyframeId& k) { return poses_.at(k); };
    std::vector<bool> kept;
    for (const PoseEdge& e : closures)
      kept.push_back((e.from.robot == kOne ? e.from : e.to).index <= last_kept);
    const std::vector<bool> possible =
        Corroboration(closures, pose, step_, dimension_, later_runs_).possible(kept);
    std::set<ClosureId> ids;
    for (std::size_t k = 0; k < closures.size(); ++k)
      if (possible[k]) ids.insert(closures[k].id());
    return ids;
  }
  [[nodiscard]] std::set<ClosureId> ids() const {
    std::set<ClosureId> ids;
    for (const PoseEdge& e : closures_) ids.insert(e.id());
    return ids;
  }
  // The step to keyframe `k` of the second robot is unknown.
  void interrupt(int k) { later_runs_[kOther].push_back(id(1, k).index); }
  [[nodiscard]] std::mt19937& rng() { return rng_; }

 private:
  static constexpr RobotId kOne = 3;
  static constexpr RobotId kOther = 8;

  static KeyframeId id(int lane, int k) {
    return {lane == 0 ? kOne : kOther, static_cast<KeyframeIndex>(k)};
  }
  // The other robot looks across the lane.
  [[nodiscard]] static SE3 truth(int lane, int k) {
    const Eigen::AngleAxisd turn(0.02 * k + lane, Eigen::Vector3d::UnitZ());
    return make_pose(turn.toRotationMatrix(), Eigen::Vector3d(k, 2.0 * lane, 0.0));
  }
  [[nodiscard]] Vector6 flat(Vector6 xi) const {
    if (dimension_ == 2) xi(0) = xi(1) = xi(5) = 0.0;
    return xi;
  }
  [[nodiscard]] SE3 noise(double sigma) { return se3_exp(flat(sigma * random_vector<6>(rng_))); }
  [[nodiscard]] Precision claim(double sigma) const {
    return {(dimension_ == 2 ? 1.0 : 0.5) / (sigma * sigma), 1.0 / (sigma * sigma)};
  }

  int dimension_;
  std::mt19937 rng_;
  Precision precision_;
  std::map<RobotId, Precision> step_;
  std::map<KeyframeId, SE3> poses_;
  LaterRuns later_runs_;
  std::vector<PoseEdge> closures_;
};

TEST_CASE("The noise of closures is estimated from pairs of closures") {
  const int dimension = GENERATE(2, 3);
  const double times = GENERATE(0.1, 1.0, 4.0);
  const double step_sigma = GENERATE(1e-6, kSigma);
  const int false_closures = GENERATE(0, 600);
  const bool turned = GENERATE(true, false);
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(dimension, times, step_sigma, false_closures, turned, seed);
  Lanes lanes(dimension, times, seed, step_sigma);
  for (int k = 0; k < kKeyframes; ++k) lanes.add_true(k, k, times);
  lanes.add_random_false(false_closures, turned);
  const auto nearest = lanes.noise_scale();
  REQUIRE(nearest);
  CHECK(nearest->lengths >= 240);  // some of the compared cycles turn too far
  CHECK(nearest->lengths <= 300);
  // The resolution of scales is 5 %. fit_noise() takes the scale nearest to 1 that loses no more
  // than 4 of the log-likelihood. These are sqrt(8) standard deviations, each 1 / sqrt(2 * 3 * 300)
  // or less.
  CHECK(nearest->scale == Approx(times).epsilon(0.12));
  const auto all = lanes.noise_scale(kAll);
  REQUIRE(all);
  CHECK(all->scale == Approx(times).epsilon(0.12));
  // No false closure here is as close as the mixture expects of some, so the consistent share
  // appears smaller.
  const double share = static_cast<double>(lanes.true_cycles()) / static_cast<double>(all->lengths);
  CHECK(all->consistent <= share + 0.01);
  CHECK(all->consistent >= share - 0.08);  // measured: 0.072
}

TEST_CASE("Cycles that count are spread over all closures") {
  Lanes lanes(3, 1.0, 1);
  for (int k = 0; k < kKeyframes; ++k) k < 40 ? lanes.add_false(k, k, false) : lanes.add_true(k, k);
  const auto noise = lanes.noise_scale(60);
  REQUIRE(noise);
  CHECK(noise->lengths == 60);
  CHECK(noise->consistent == Approx(260.0 / 300.0).margin(0.1));
}

TEST_CASE("Too few closures give no estimate of their noise") {
  Lanes lanes(GENERATE(2, 3), 1.0, 3);
  CHECK_FALSE(lanes.noise_scale());
  lanes.add_true(0, 0);
  CHECK_FALSE(lanes.noise_scale());
  for (int k = 1; k < 12; ++k) lanes.add_true(25 * k, 25 * k);  // too far apart to be compared
  CHECK_FALSE(lanes.noise_scale());
}

TEST_CASE("Lengths that are not finite are not counted") {
  NoiseHistogram histogram;
  count_length(histogram, std::numeric_limits<double>::infinity());
  count_length(histogram, std::nan(""));
  CHECK(histogram.empty());
  count_length(histogram, 0.0);
  count_length(histogram, 1e300);
  CHECK(histogram.size() == 2);
}

// Lengths of cycles: `share_false` of them have the size `false_size` and any spread, the others
// are `scale` times noisier than stated.
NoiseHistogram draw_lengths(unsigned seed, std::size_t count, double scale, double spread,
                            double share_false, double false_size, double false_spread) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  NoiseHistogram histogram;
  for (std::size_t k = 0; k < count; ++k) {
    const bool is_false = static_cast<double>(k) < share_false * static_cast<double>(count);
    const double length = random_vector<6>(rng).norm();
    const double blur = std::exp((is_false ? false_spread : spread) * normal(rng));
    count_length(histogram, (is_false ? false_size : scale) * blur * length);
  }
  return histogram;
}

TEST_CASE("Cycles with false closures do not set the noise scale, however many they are") {
  const double share_false = GENERATE(0.3, 0.89, 0.95);
  const double scale = GENERATE(0.5, 3.0);
  const double false_size = GENERATE(20.0, 60.0);
  const double false_spread = GENERATE(0.0, 0.6);
  CAPTURE(share_false, scale, false_size, false_spread);
  const auto noise =
      fit_noise(draw_lengths(1, 300, scale, 0.0, share_false, false_size, false_spread), 3);
  REQUIRE(noise);
  // The scale nearest to 1 is up to sqrt(8) standard deviations from the best one, each
  // 1 / sqrt(2 * 6 * 15).
  CHECK(noise->scale == Approx(scale).epsilon(0.4));
  CHECK(noise->consistent == Approx(1.0 - share_false).margin(0.1));
}

TEST_CASE("Noise whose lengths spread more than those of normal vectors is one population") {
  const double scale = GENERATE(2.0, 4.0, 10.0);
  const double spread = GENERATE(0.0, 0.3, 0.6);
  const double share_false = GENERATE(0.0, 0.3);
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(scale, spread, share_false, seed);
  const auto noise = fit_noise(draw_lengths(seed, 300, scale, spread, share_false, 300.0, 1.0), 3);
  REQUIRE(noise);
  CHECK(noise->scale > 0.75 * scale);
  CHECK(noise->scale < 2.0 * scale);
}

TEST_CASE("Near closures that agree do not stand alone") {
  Lanes lanes(GENERATE(2, 3), 1.0, GENERATE(range(1U, 6U)));
  for (const int k : {10, 12, 15, 100, 101, 200, 205}) lanes.add_true(k, k);
  CHECK(lanes.isolated().empty());
}

TEST_CASE("A closure far from all others stands alone") {
  Lanes lanes(GENERATE(2, 3), 1.0, 4);
  for (const int k : {10, 40, 70}) lanes.add_true(k, k);
  CHECK(lanes.isolated() == lanes.ids());
}

TEST_CASE("No cycle contains an unknown step") {
  Lanes lanes(3, 1.0, 2);
  for (int k = 0; k < 40; ++k) lanes.add_true(k, k);
  for (int k = 1; k < 40; ++k) lanes.interrupt(k);
  CHECK_FALSE(lanes.noise_scale());
  CHECK(lanes.isolated().size() == 40);
}

TEST_CASE("False closures stand alone, even near true ones") {
  const unsigned seed = GENERATE(range(1U, 6U));
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, dimension);
  Lanes lanes(dimension, 1.0, seed);
  lanes.add_false(50, 150);
  lanes.add_false(101, 103);
  lanes.add_false(152, 149);
  lanes.add_false(153, 150);
  const std::set<ClosureId> all_false = lanes.ids();
  CHECK(lanes.isolated() == all_false);
  for (int k = 98; k < 106; ++k) lanes.add_true(k, k);
  for (int k = 148; k < 156; ++k) lanes.add_true(k, k);
  CHECK(lanes.isolated() == all_false);
}

std::vector<PoseEdge> seen_from_the_other(std::vector<PoseEdge> closures) {
  for (PoseEdge& e : closures) {
    std::swap(e.from, e.to);
    e.T_from_to = e.T_from_to.inverse();
  }
  return closures;
}

TEST_CASE("Both robots of a pair find equal sets of closures that stand alone") {
  const unsigned seed = GENERATE(range(1U, 6U));
  const int dimension = GENERATE(2, 3);
  CAPTURE(seed, dimension);
  Lanes lanes(dimension, 1.0, seed);
  for (int k = 0; k < kKeyframes; k += 3) lanes.add_true(k, k, k % 2 == 0 ? 1.0 : 4.0);
  lanes.add_random_false(100);
  lanes.add_random_false(100, false);
  std::vector<PoseEdge> seen_from_there = seen_from_the_other(lanes.closures());
  std::shuffle(seen_from_there.begin(), seen_from_there.end(), lanes.rng());
  const std::set<ClosureId> alone = lanes.isolated();
  CHECK(alone.size() > 50);
  CHECK(alone.size() < lanes.closures().size());
  CHECK(lanes.isolated(seen_from_there) == alone);
}

// The solution is as imprecise as the path here, so half of the true ones are possible. The bound
// is three standard deviations of the binomial distribution below.
TEST_CASE("Drift explains true closures far from the kept ones, but no random ones") {
  const int dimension = GENERATE(2, 3);
  CAPTURE(dimension);
  int of_true = 0, of_false = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Lanes lanes(dimension, 1.0, seed);
    for (int k = 0; k <= 50; k += 5) lanes.add_true(k, k);
    for (const int k : {80, 120, 199}) lanes.add_true(k, k);
    std::set<ClosureId> possible = lanes.possible(lanes.closures(), 50);
    CHECK(lanes.possible(seen_from_the_other(lanes.closures()), 50) == possible);
    of_true += static_cast<int>(possible.size());
    for (int k = 51; k < kKeyframes; k += 7) lanes.add_false(k, kKeyframes - 1 - k);
    of_false += static_cast<int>(lanes.possible(lanes.closures(), 50).size() - possible.size());
  }
  CHECK(of_true >= 124);   // 300 in all
  CHECK(of_false <= 110);  // 2200 in all
}

TEST_CASE("Nothing is possible beyond an unknown step") {
  Lanes lanes(3, 1.0, 5);
  for (const int k : {10, 20, 30}) lanes.add_true(k, k);
  lanes.interrupt(25);
  CHECK(lanes.possible(lanes.closures(), 20).empty());
}

}  // namespace
}  // namespace km
