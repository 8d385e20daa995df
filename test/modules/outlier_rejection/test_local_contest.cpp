#include "test/support/test.hpp"
#include "modules/outlier_rejection/local_contest.hpp"
#include "modules/outlier_rejection/witnessed_pair.hpp"
#include "test/modules/outlier_rejection/chain.hpp"

namespace km {
namespace {

// Two robots drive along one row of equal tents, a metre per keyframe. Their odometry frames are
// equal.
struct TentRow {
  Chain a{0}, b{1};

  TentRow() {
    for (std::size_t i = 1; i < 60; ++i) {
      a.step(rotz(0.0, 1.0));
      b.step(rotz(0.0, 1.0));
    }
  }

  // Measured with an error of `shift_m`.
  [[nodiscard]] Closure at(std::size_t i, std::size_t j, double shift_m, int inliers) const {
    const double apart_m = static_cast<double>(j) - static_cast<double>(i);
    Closure seen = closure(a.at(i), b.at(j), rotz(0.0, apart_m + shift_m));
    seen.inliers = inliers;
    return seen;
  }
};

LocalContest contest_of(const std::vector<Closure>& closures) {
  LocalContest contest{PcmConfig{}};
  for (const Closure& closure : closures) contest.add(closure);
  return contest;
}

TEST_CASE("A closure that is shifted by one tent is overruled by those beside it") {
  const TentRow row;
  std::vector<Closure> closures = {row.at(10, 10, 0.0, 60), row.at(11, 12, 0.0, 60),
                                   row.at(12, 12, 6.0, 30), row.at(13, 11, 6.0, 29)};
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  std::ranges::shuffle(closures, rng);
  const LocalContest contest = contest_of(closures);
  for (const Closure& closure : closures) {
    CAPTURE(closure.inliers);
    CHECK(contest.is_overruled(closure.id()) == (closure.inliers < 60));
  }
}

TEST_CASE("Half the support overrules nothing, and neither do closures far away") {
  const TentRow row;
  const Closure weak = row.at(10, 10, 6.0, 31);
  SECTION("half the support") {
    CHECK_FALSE(contest_of({weak, row.at(11, 11, 0.0, 61)}).is_overruled(weak.id()));
    CHECK(contest_of({weak, row.at(11, 11, 0.0, 62)}).is_overruled(weak.id()));
  }
  SECTION("far away") {
    const auto last = std::size_t{10} + LocalContest::kNear;
    CHECK(contest_of({weak, row.at(last, 10, 0.0, 100)}).is_overruled(weak.id()));
    CHECK(contest_of({weak, row.at(10, last, 0.0, 100)}).is_overruled(weak.id()));
    CHECK_FALSE(contest_of({weak, row.at(last + 1, 10, 0.0, 100)}).is_overruled(weak.id()));
    CHECK_FALSE(contest_of({weak, row.at(10, last + 1, 0.0, 100)}).is_overruled(weak.id()));
  }
  SECTION("closures that do not state their inliers") {
    CHECK_FALSE(contest_of({weak, row.at(11, 11, 0.0, 0)}).is_overruled(weak.id()));
    const Closure unstated = row.at(11, 11, 6.0, 0);
    CHECK_FALSE(contest_of({unstated, row.at(12, 12, 0.0, 0)}).is_overruled(unstated.id()));
  }
  SECTION("not added") {
    CHECK_FALSE(contest_of({row.at(11, 11, 0.0, 100)}).is_overruled(weak.id()));
  }
}

TEST_CASE("Errors that stated covariances allow threefold overrule nothing") {
  const TentRow row;
  // Both closures have a standard deviation of 1 cm an axis; 5 cm are five sigmas of one.
  const Closure close = row.at(10, 10, 0.05, 20);
  CHECK_FALSE(contest_of({close, row.at(10, 11, 0.0, 100)}).is_overruled(close.id()));
}

TEST_CASE("The support is the inliers of closures at one place that agree") {
  const TentRow row;
  // Two agree, a third beside them is shifted by a tent, and a fourth is at another place.
  std::vector<Closure> closures = {row.at(10, 10, 0.0, 70), row.at(12, 12, 0.0, 79),
                                   row.at(11, 11, 6.0, 90), row.at(40, 40, 6.0, 80)};
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  std::ranges::shuffle(closures, rng);
  CHECK(contest_of(closures).most_support() == 149.0);
  CHECK(contest_of({}).most_support() == 0.0);

  PcmConfig config{.min_witnesses = 3};
  WitnessedPair pair(0, 1, config);
  for (const Closure& closure : closures) (void)pair.add(closure);
  CHECK(pair.support() == 149);
  CHECK_FALSE(pair.is_strong());
  (void)pair.add(row.at(13, 13, 0.0, 1));
  CHECK(pair.is_strong());
}

TEST_CASE("A closure whose stronger neighbours are dropped is not overruled any more") {
  const TentRow row;
  const Closure weak = row.at(10, 10, 6.0, 31), strong = row.at(11, 11, 0.0, 90);
  LocalContest contest = contest_of({weak, strong});
  REQUIRE(contest.is_overruled(weak.id()));
  contest.keep({weak.id()});
  CHECK_FALSE(contest.is_overruled(weak.id()));
}

TEST_CASE("A pair does not publish overruled closures") {
  const TentRow row;
  WitnessedPair pair(0, 1, PcmConfig{});
  const Closure weak = row.at(10, 10, 6.0, 31), strong = row.at(11, 11, 0.0, 90),
                far = row.at(40, 40, 0.0, 50);
  (void)pair.add(weak);
  CHECK(pair.closures() == std::vector<ClosureId>{weak.id()});
  (void)pair.add(strong);
  (void)pair.add(far);
  CHECK(pair.closures() == std::vector<ClosureId>{strong.id(), far.id()});
  CHECK(pair.add(weak) == PcmAddResult::kRepeated);
}

}  // namespace
}  // namespace km
