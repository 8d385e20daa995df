#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <random>

#include "modules/sensors/stream_stamps.hpp"

namespace km {
namespace {

constexpr StampVerdict kGood = StampVerdict::kGood, kRepeated = StampVerdict::kRepeated,
                       kUnordered = StampVerdict::kUnordered, kJump = StampVerdict::kJump;
constexpr Stamp kDay = 86'400'000'000'000;
using Verdicts = std::vector<StampVerdict>;

TEST_CASE("One wrong stamp at any place affects no other stamp", "[sensors]") {
  const std::size_t place = GENERATE(0U, 1U, 5U, 8U, 9U);
  const Stamp offset = GENERATE(values<Stamp>({kDay, -kDay, 25, -25}));
  std::vector<Stamp> stamps;
  for (int i = 0; i < 10; ++i) stamps.push_back(2 * kDay + 10 * i);
  stamps[place] += offset;
  CAPTURE(place, offset);
  const Verdicts verdicts = judge_stamps(stamps);
  const bool still_in_order = (place == 0 && offset == -25) || (place == 9 && offset == 25);
  CHECK(std::count(verdicts.begin(), verdicts.end(), kGood) == (still_in_order ? 10 : 9));
  CHECK((verdicts[place] == kGood) == still_in_order);
}

TEST_CASE("After a clock was set the part with the most stamps is kept", "[sensors]") {
  CHECK(judge_stamps(std::vector<Stamp>{1, 2, kDay, kDay + 1, kDay + 2}) ==
        Verdicts{kJump, kJump, kGood, kGood, kGood});
  CHECK(judge_stamps(std::vector<Stamp>{kDay, kDay + 1, 1, 2, 3}) ==
        Verdicts{kUnordered, kUnordered, kGood, kGood, kGood});
  CHECK(judge_stamps(std::vector<Stamp>{1, kDay}) == Verdicts{kGood, kJump});
  const Stamp minute = 60'000'000'000;  // a pause of a minute belongs to a recording
  CHECK(judge_stamps(std::vector<Stamp>{1, 2, 2, minute, minute + 1}) ==
        Verdicts{kGood, kGood, kRepeated, kGood, kGood});
}

TEST_CASE("No other choice of stamps in order keeps more of them", "[sensors]") {
  CHECK(judge_stamps({}).empty());
  const unsigned seed = GENERATE(range(0U, 50U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::vector<Stamp> stamps(10);
  for (Stamp& stamp : stamps) stamp = std::uniform_int_distribution<Stamp>(1, 12)(rng);
  int most = 0;
  for (unsigned subset = 0; subset < 1U << stamps.size(); ++subset) {
    Stamp last = 0;
    int size = 0;
    for (std::size_t i = 0; i < stamps.size() && size >= 0; ++i) {
      if ((subset >> i & 1U) == 0) continue;
      size = stamps[i] > last ? size + 1 : -1;
      last = stamps[i];
    }
    most = std::max(most, size);
  }
  const Verdicts verdicts = judge_stamps(stamps);
  Stamp last = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (verdicts[i] != kGood) continue;
    CHECK(stamps[i] > last);
    last = stamps[i];
  }
  CHECK(std::count(verdicts.begin(), verdicts.end(), kGood) == most);
}

Verdicts judged_as_they_come(const std::vector<Stamp>& stamps) {
  StampOrder order;
  Verdicts verdicts;
  for (const Stamp stamp : stamps) verdicts.push_back(order.judge(stamp));
  return verdicts;
}

TEST_CASE("Stamps of a stream are judged one by one", "[sensors]") {
  CHECK(judged_as_they_come({10, 20, 20, 15, 30}) ==
        Verdicts{kGood, kGood, kRepeated, kUnordered, kGood});
  CHECK(judged_as_they_come({10, 20, kDay, 30, -kDay, 40}) ==
        Verdicts{kGood, kGood, kJump, kGood, kJump, kGood});
  const Stamp least = std::numeric_limits<Stamp>::min(), most = std::numeric_limits<Stamp>::max();
  CHECK(judged_as_they_come({10, least, most, 20}) == Verdicts{kGood, kJump, kJump, kGood});
}

TEST_CASE("The clock of a stream may be set but not back to times already used", "[sensors]") {
  // Forward, as by a time server, and also if it began with an invalid stamp.
  CHECK(judged_as_they_come({10, 20, 30, 40, kDay, kDay + 1, kDay + 2, kDay + 3}) ==
        Verdicts{kGood, kGood, kGood, kGood, kJump, kJump, kGood, kGood});
  CHECK(judged_as_they_come({kDay, 10, 20, 30, 40}) == Verdicts{kGood, kJump, kJump, kGood, kGood});
  CHECK(judged_as_they_come({kDay, kDay + 1, kDay + 2, 10, 20, 30, 40, kDay + 3}) ==
        Verdicts{kGood, kGood, kGood, kJump, kJump, kJump, kJump, kGood});
}

constexpr Stamp kInterval = 50'000'000;

TEST_CASE("Missing images are counted at any jitter", "[sensors]") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<Stamp> jitter(-kInterval / 10, kInterval / 10);
  std::bernoulli_distribution is_lost(0.1);
  MissingImages missing;
  std::size_t lost = 0, counted = 0;
  for (int k = 0; k < 1000; ++k) {
    const bool can_be_lost = k > 2 * static_cast<int>(MissingImages::kFewest) && k < 999;
    if (can_be_lost && is_lost(rng))
      ++lost;
    else
      counted += missing.before(k * kInterval + jitter(rng)).missing;
  }
  CHECK(lost > 50);
  CHECK(counted == lost);
}

TEST_CASE("A new stream or a new rate reports missing images only briefly", "[sensors]") {
  MissingImages missing;
  CHECK(missing.before(kInterval).missing == 0);
  CHECK(missing.before(9 * kInterval).missing == 0);  // the interval is not known yet
  Stamp stamp = 9 * kInterval;
  for (int k = 0; k < 50; ++k) CHECK(missing.before(stamp += kInterval).missing == 0);
  CHECK(missing.before(stamp += 40 * kInterval).missing == 39);
  const ImageGap restart = missing.before(stamp += 41 * kInterval);
  CHECK(restart.missing == 0);
  CHECK(restart.pause_s == Approx(2.05));
  std::size_t counted = 0;
  for (int k = 0; k < 100; ++k) counted += missing.before(stamp += 2 * kInterval).missing;
  CHECK(counted <= MissingImages::kIntervals / 2 + 1);
}

}  // namespace
}  // namespace km
