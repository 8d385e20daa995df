#pragma once

#include <exception>

#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {

/// Corrupts input as people, programs and networks do. The same seed gives the same faults.
class InputCorrupter {
 public:
  using Bytes = std::vector<std::uint8_t>;

  explicit InputCorrupter(unsigned seed) : rng_(seed) {}

  /// Corrupts a text: invalid numbers, lines lost, repeated, exchanged or cut, garbage, other line
  /// ends.
  [[nodiscard]] std::string operator()(std::string text) {
    const int faults = below(3) + 1;
    for (int i = 0; i < faults; ++i) corrupt(text);
    return text;
  }

  /// Corrupts one of several messages: invalid counts and indices, octets lost, changed or added,
  /// or a part of another message.
  [[nodiscard]] Bytes operator()(const std::vector<Bytes>& samples) {
    const auto one_of = [&] { return static_cast<std::size_t>(below(samples.size())); };
    Bytes bytes = samples[one_of()];
    const int faults = below(4) + 1;
    for (int i = 0; i < faults; ++i) corrupt(bytes, samples[one_of()]);
    return bytes;
  }

 private:
  static constexpr std::array kNumbers = {"nan",
                                          "-inf",
                                          "1e300",
                                          "-1e300",
                                          "1e-300",
                                          "1e400",
                                          "1e30",
                                          "-1",
                                          "0",
                                          "0.5",
                                          "1e9",
                                          "",
                                          "9223372036854775807",
                                          "-9223372036854775808",
                                          "99999999999999999999",
                                          "86400000000000",
                                          "x"};

  // Lengths, counts and indices at which readers tend to fail.
  static constexpr std::array<std::uint32_t, 8> kWords = {
      0, 1, 0x7f, 0xff, 0xffff, 0x7fffffff, 0x80000000, 0xffffffff};

  int below(std::size_t n) {
    return static_cast<int>(std::uniform_int_distribution<std::size_t>(0, n - 1)(rng_));
  }
  template <typename Octets>
  std::size_t place_in(const Octets& octets) {
    return static_cast<std::size_t>(below(octets.size() + 1));
  }
  template <typename Octets>
  auto iterator_in(Octets& octets) {
    return octets.begin() + static_cast<std::ptrdiff_t>(place_in(octets));
  }

  void corrupt(std::string& text) {
    switch (below(12)) {
      case 0:
      case 1:
      case 2:
        return replace_number(text);
      case 3:
      case 4:
        return shuffle_lines(text);
      case 5:
      case 6:
      case 7:
      case 8:
        return corrupt_octets(text);
      case 9:
        text.insert(place_in(text), std::string(100'000, "0 ,x\0"[below(5)]));
        return;
      case 10:
        for (std::size_t at = 0; (at = text.find('\n', at)) != text.npos; at += 2)
          text.replace(at, 1, "\r\n");
        return;
      default:
        text.insert(0, "\xEF\xBB\xBF");
    }
  }

  void corrupt(Bytes& bytes, const Bytes& other) {
    switch (below(6)) {
      case 0:
        return replace_word(bytes);
      case 1:
      case 2:
        return flip_bit(bytes);
      case 3: {
        const std::size_t at = place_in(bytes);
        const std::size_t size = std::min(other.size(), bytes.size() - at);
        std::copy_n(other.begin(), size, bytes.begin() + static_cast<std::ptrdiff_t>(at));
        return;
      }
      default:
        return corrupt_octets(bytes);
    }
  }

  template <typename Octets>
  void corrupt_octets(Octets& octets) {
    using Octet = typename Octets::value_type;
    switch (below(4)) {
      case 0: {
        const auto at = iterator_in(octets);
        octets.erase(at, at + std::min<std::ptrdiff_t>(below(40), octets.end() - at));
        return;
      }
      case 1:
        octets.resize(place_in(octets));
        return;
      case 2:
        for (int i = below(30); i >= 0; --i)
          octets.insert(iterator_in(octets), static_cast<Octet>(below(256)));
        return;
      default:
        flip_bit(octets);
    }
  }

  template <typename Octets>
  void flip_bit(Octets& octets) {
    using Octet = typename Octets::value_type;
    if (!octets.empty())
      octets[place_in(octets) % octets.size()] ^= static_cast<Octet>(1 << below(8));
  }

  // Four octets at a possible position of a number, little-endian.
  void replace_word(Bytes& bytes) {
    const std::size_t at = place_in(bytes) / 4 * 4;
    const std::uint32_t word = kWords[static_cast<std::size_t>(below(kWords.size()))];
    for (std::size_t k = 0; k < 4 && at + k < bytes.size(); ++k)
      bytes[at + k] = static_cast<std::uint8_t>(word >> (8 * k));
  }

  // A run of digits, signs and points is replaced by another number, or followed by it.
  void replace_number(std::string& text) {
    constexpr std::string_view kDigits = "0123456789.+-";
    const std::size_t begin = text.find_first_of(kDigits, place_in(text));
    if (begin == text.npos) return;
    const std::size_t end = std::min(text.find_first_not_of(kDigits, begin), text.size());
    const auto number = static_cast<std::size_t>(below(kNumbers.size()));
    text.replace(begin, below(4) == 0 ? 0 : end - begin, kNumbers[number]);
  }

  void shuffle_lines(std::string& text) {
    std::vector<std::string> lines;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size() - 1);
      lines.push_back(text.substr(begin, end + 1 - begin));
      begin = end + 1;
    }
    if (lines.empty()) return;
    const auto a = static_cast<std::size_t>(below(lines.size()));
    const auto b = static_cast<std::size_t>(below(lines.size()));
    const int kind = below(3);
    if (kind == 0) lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(a), lines[b]);
    if (kind == 1) std::swap(lines[a], lines[b]);
    if (kind == 2) lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(a));
    text.clear();
    for (const std::string& line : lines) text += line;
  }

  std::mt19937 rng_;
};

/// Number of corrupted files of a kind that a test reads; KIMERA_MULTI_CORRUPTED_FILES increases
/// it.
[[nodiscard]] inline unsigned corrupted_files() {
  const char* const wanted = std::getenv("KIMERA_MULTI_CORRUPTED_FILES");
  return wanted == nullptr ? 100U : static_cast<unsigned>(std::atoi(wanted));
}

/// Calls `read` with the valid text, which it must accept, and with many corrupted ones. It may
/// throw an `Error` of a few lines that names `name`, and no other exception. It must check the
/// content that it accepts.
template <typename Error, typename Read>
void check_corrupted(const std::string& good, const std::string& name, const Read& read) {
  REQUIRE_NOTHROW(read(good));
  unsigned refused = 0;
  for (unsigned seed = 0; seed < corrupted_files(); ++seed) {
    CAPTURE(seed);
    try {
      read(InputCorrupter(seed)(good));
    } catch (const Error& error) {
      ++refused;
      const std::string_view message = error.what();
      CHECK(message.find(name) != message.npos);
      CHECK(message.size() < 5000);
    } catch (const std::exception& error) {
      FAIL_CHECK("not an error of input: " << error.what());
    }
  }
  CHECK(refused < corrupted_files());  // otherwise no accepted content was examined
}

/// Paths without a readable file.
[[nodiscard]] inline std::vector<fs::path> no_files(const TemporaryFolder& folder,
                                                    const std::string& extension) {
  namespace fs = std::filesystem;
  const fs::path loop = folder.path() / ("loop" + extension);
  fs::create_symlink(loop.filename(), loop);
  const fs::path place = folder.path() / ("folder" + extension);
  fs::create_directory(place);
  return {folder.path() / ("missing" + extension), loop, loop / ("below" + extension), place,
          folder.path() / (std::string(300, 'n') + extension)};
}

/// Checks that `read` refuses each of them with an `Error` that names it.
template <typename Error, typename Read>
void check_no_files(const std::string& extension, const Read& read) {
  const TemporaryFolder folder;
  for (const fs::path& place : no_files(folder, extension)) {
    CAPTURE(place);
    try {
      read(place);
      FAIL_CHECK("was read");
    } catch (const Error& error) {
      CHECK_THAT(error.what(), Contains(place.string().substr(0, 150)));
    } catch (const std::exception& error) {
      FAIL_CHECK("not an error of input: " << error.what());
    }
  }
}

}  // namespace km
