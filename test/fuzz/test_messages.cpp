#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <random>

#include "runtime/dds/codec.hpp"
#include "test/fuzz/all_messages.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Lengths, counts and indices at which readers go wrong.
constexpr std::array<std::uint32_t, 8> kTricky{0,      1,          0x7f,       0xff,
                                               0xffff, 0x7fffffff, 0x80000000, 0xffffffff};

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(seed) {}

  [[nodiscard]] Bytes spoil(const MessageReader& reader) {
    Bytes bytes = one_of(reader.samples);
    for (std::size_t k = below(4) + 1; k > 0; --k) spoil_once(bytes, one_of(reader.samples));
    return bytes;
  }

 private:
  std::size_t below(std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random_);
  }
  const Bytes& one_of(const std::vector<Bytes>& samples) { return samples[below(samples.size())]; }

  void spoil_once(Bytes& bytes, const Bytes& other) {
    const std::size_t at = below(bytes.size() + 1);
    switch (below(6)) {
      case 0:
        if (at < bytes.size()) bytes[at] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 1:
        if (at < bytes.size()) bytes[at] = static_cast<std::uint8_t>(below(256));
        break;
      case 2:
        for (std::size_t k = 0; k < 4 && at / 4 * 4 + k < bytes.size(); ++k)
          bytes[at / 4 * 4 + k] =
              static_cast<std::uint8_t>(kTricky[below(kTricky.size())] >> (8 * k));
        break;
      case 3:
        bytes.resize(at);
        break;
      case 4:
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), below(20),
                     static_cast<std::uint8_t>(below(256)));
        break;
      default:
        std::copy_n(other.begin(), std::min(other.size(), bytes.size() - at),
                    bytes.begin() + static_cast<std::ptrdiff_t>(at));
    }
  }

  std::mt19937 random_;
};

TEST_CASE("What robots send each other is understood as it is sent", "[messages]") {
  for (const MessageReader& reader : all_messages()) {
    CAPTURE(reader.name);
    for (const Bytes& sample : reader.samples) CHECK(feed(reader, sample));
  }
}

TEST_CASE("No message ends where it does not end", "[messages]") {
  for (const MessageReader& reader : all_messages()) {
    CAPTURE(reader.name);
    for (Bytes sample : reader.samples)
      while (!sample.empty()) {
        sample.pop_back();
        CHECK_FALSE(feed(reader, sample));
      }
  }
}

// KM_MESSAGES sets how many.
TEST_CASE("Spoilt messages of all topics harm nobody", "[messages]") {
  const char* wanted = std::getenv("KM_MESSAGES");
  const long count = wanted == nullptr ? 100'000 : std::atol(wanted);
  const auto readers = all_messages();
  Mutator mutator(GENERATE(1U, 2U));
  long accepted = 0;
  for (long k = 0; k < count / 2; ++k) {
    const MessageReader& reader = readers[static_cast<std::size_t>(k) % readers.size()];
    accepted += feed(reader, mutator.spoil(reader)) ? 1 : 0;
  }
  // Some bytes are free, most are not.
  CHECK(accepted > 0);
  CHECK(accepted < count / 4);
}

}  // namespace
}  // namespace km
