#include "runtime/token_bucket.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <random>
#include <vector>

namespace km {
namespace {

constexpr double kRounding = 1e-9;  // rounding of sums of some hundred terms

TEST_CASE("Tokens flow in at their rate up to the capacity", "[token_bucket]") {
  TokenBucket bucket(10.0, 5.0, 2.0);
  CHECK(bucket.wait_s(2.0, 100.0) == 0.0);
  CHECK(bucket.wait_s(5.0, 100.0) == Approx(0.3));
  CHECK(bucket.wait_s(5.0, 100.2) == Approx(0.1));
  CHECK(bucket.wait_s(5.0, 100.31) == 0.0);
  bucket.spend(5.0, 200.0);  // no more than the capacity has come together
  CHECK(bucket.wait_s(0.0, 200.0) == 0.0);
  CHECK(bucket.wait_s(1.0, 200.0) == Approx(0.1));
}

TEST_CASE("Later tokens pay a debt first", "[token_bucket]") {
  TokenBucket bucket(10.0, 5.0, 0.0);
  bucket.spend(30.0, 0.0);
  CHECK(bucket.wait_s(0.0, 0.0) == Approx(3.0));
  CHECK(bucket.wait_s(0.0, 1.0) == Approx(2.0));
  bucket.spend(10.0, 1.0);
  CHECK(bucket.wait_s(0.0, 1.0) == Approx(3.0));
  CHECK(bucket.wait_s(0.0, 4.0 + kRounding) == 0.0);
}

TEST_CASE("Spending whenever there is no debt is spending at the rate", "[token_bucket]") {
  const auto seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> amount(0.0, 300.0);
  constexpr double kRate = 1000.0, kSeconds = 50.0, kCapacity = 100.0;
  TokenBucket bucket(kRate, kCapacity, 0.0);
  double now_s = 7.0, spent = 0.0, last = 0.0;
  while (true) {
    now_s += bucket.wait_s(0.0, now_s) + kRounding;
    if (now_s >= 7.0 + kSeconds) break;
    last = amount(rng);
    bucket.spend(last, now_s);
    spent += last;
  }
  // All except for the last debt has been paid, and no tokens were lost to a full bucket.
  CHECK(spent >= kRate * kSeconds - 1.0);
  CHECK(spent <= kRate * kSeconds + last);
}

TEST_CASE("A bucket of an infinite rate is always full", "[token_bucket]") {
  TokenBucket bucket(std::numeric_limits<double>::infinity(), 1.0, 0.0);
  for (int k = 0; k < 3; ++k) {
    CHECK(bucket.wait_s(1.0, 5.0) == 0.0);
    bucket.spend(7.0, 5.0);
  }
}

}  // namespace
}  // namespace km
