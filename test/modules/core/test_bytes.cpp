#include "modules/core/io/bytes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST_CASE("Bytes: hashing eight at a time gives FNV-1a with the last ones padded by zeros") {
  const auto hash_of = [](const Bytes& bytes) {
    std::uint64_t hash = kFnv1aBasis;
    mix_fnv1a(hash, bytes);
    return hash;
  };
  CHECK(hash_of({}) == kFnv1aBasis);
  const std::string text = "chongo was here!";
  CHECK(hash_of(Bytes(text.begin(), text.end())) == 0x858e2fa32a55e61dULL);
  const Bytes odd{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  CHECK(hash_of(odd) == 0x4be607e06a4cf7d1ULL);
  Bytes filled = odd;
  filled.resize(16);
  CHECK(hash_of(filled) == hash_of(odd));
}

TEST_CASE("Bytes: every number is read back unchanged") {
  ByteWriter out;
  out.u8(0xAB);
  out.u16(0xBEEF);
  out.u32(0xDEADBEEF);
  out.u64(0x0123456789ABCDEF);
  out.f32(-1.5F);
  out.f64(std::numeric_limits<double>::denorm_min());
  out.f64(std::numeric_limits<double>::quiet_NaN());
  out.bytes(Bytes{1, 2, 3});
  CHECK(out.size() == 1 + 2 + 4 + 8 + 4 + 8 + 8 + 3);
  const Bytes bytes = out.release();
  CHECK(out.size() == 0);

  ByteReader in(bytes);
  CHECK(in.u8() == 0xAB);
  CHECK(in.u16() == 0xBEEF);
  CHECK(in.u32() == 0xDEADBEEF);
  CHECK(in.u64() == 0x0123456789ABCDEF);
  CHECK(in.f32() == -1.5F);
  CHECK(in.f64() == std::numeric_limits<double>::denorm_min());
  CHECK(std::isnan(in.f64()));
  CHECK_FALSE(in.done());
  const auto tail = in.bytes(3);
  CHECK(Bytes(tail.begin(), tail.end()) == Bytes{1, 2, 3});
  CHECK(in.done());
}

TEST_CASE("Bytes: the least significant byte comes first") {
  ByteWriter out;
  out.u32(0x01020304);
  out.f32(1.0F);
  CHECK(out.release() == Bytes{4, 3, 2, 1, 0, 0, 0x80, 0x3F});
}

TEST_CASE("Bytes: a varint has as many bytes as necessary and one form only") {
  const auto [value, size] = GENERATE(
      table<std::uint64_t, std::size_t>({{0, 1},
                                         {127, 1},
                                         {128, 2},
                                         {16383, 2},
                                         {16384, 3},
                                         {std::uint64_t{1} << 63U, 10},
                                         {std::numeric_limits<std::uint64_t>::max(), 10}}));
  CAPTURE(value);
  ByteWriter out;
  out.varint(value);
  Bytes bytes = out.release();
  CHECK(bytes.size() == size);
  ByteReader in(bytes);
  CHECK(in.varint() == value);
  CHECK(in.done());

  if (value > 0) CHECK((ByteReader(bytes).varint(value - 1) == 0));
  bytes.back() |= 0x80U;  // the same number followed by a zero
  bytes.push_back(0);
  ByteReader padded(bytes);
  CHECK(padded.varint() == 0);
  CHECK(padded.failed());
}

TEST_CASE("Bytes: a varint above 64 bits or its type fails") {
  const Bytes too_long(11, 0xFF);
  Bytes too_large(10, 0xFF);
  too_large.back() = 2;
  CHECK(ByteReader(too_long).varint() == 0);
  CHECK(ByteReader(too_large).varint() == 0);
  const Bytes above_16_bits{0x80, 0x80, 0x04};
  ByteReader in(above_16_bits);
  CHECK(in.varint_as<std::uint16_t>() == 0);
  CHECK(in.failed());
}

TEST_CASE("Bytes: counts that exceed the remaining bytes are refused") {
  ByteWriter out;
  out.varint(3);
  for (int k = 0; k < 11; ++k) out.u8(0);
  const Bytes bytes = out.release();
  CHECK(ByteReader(bytes).count(3, 3) == 3);
  CHECK(ByteReader(bytes).count(3, 4) == 0);
  CHECK(ByteReader(bytes).count(2, 1) == 0);

  out.varint(std::numeric_limits<std::uint64_t>::max());
  const Bytes huge = out.release();
  ByteReader in(huge);
  CHECK(in.count(std::numeric_limits<std::size_t>::max(), 1) == 0);
  CHECK(in.failed());
}

// Reads bytes in a fixed pattern; the address sanitiser detects a read past the end.
std::uint64_t read_all(const Bytes& bytes) {
  ByteReader in(bytes);
  std::uint64_t sum = 0;
  const std::size_t n = in.count(1000, 2);
  for (std::size_t k = 0; k < n; ++k) sum += in.u16();
  sum += in.u64() + in.varint() + in.u32();
  sum += in.bytes(in.count(64, 1)).size();
  return in.done() ? sum : 0;
}

TEST_CASE("Bytes: truncated or changed input is read to its end and no further") {
  ByteWriter out;
  out.varint(20);
  for (std::uint16_t k = 0; k < 20; ++k) out.u16(k);
  out.u64(7);
  out.varint(300);
  out.u32(9);
  out.varint(5);
  out.bytes(Bytes(5, 1));
  const Bytes bytes = out.release();
  CHECK(read_all(bytes) == 190 + 7 + 300 + 9 + 5);

  for (std::size_t size = 0; size < bytes.size(); ++size)
    CHECK(read_all(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size))) == 0);

  std::mt19937 random(GENERATE(1U, 2U, 3U));
  for (int run = 0; run < 20000; ++run) {
    Bytes changed = bytes;
    const std::size_t changes = 1 + random() % 4;
    for (std::size_t k = 0; k < changes; ++k) {
      const std::size_t place = random() % changed.size();
      changed[place] = static_cast<std::uint8_t>(random());
    }
    changed.resize(1 + random() % changed.size());
    (void)read_all(changed);
  }
}

}  // namespace
}  // namespace km
