#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "modules/place_recognition/bag_of_words.hpp"

namespace km {

/// An image of the database and its score against a query.
struct BowMatch {
  std::size_t index = 0;  ///< In order of add().
  float score = 0.0F;

  bool operator==(const BowMatch&) const = default;
};

/// Range and bounds of a query.
struct BowQuery {
  /// Only images 0, ..., last - 1 are compared.
  std::size_t last = std::numeric_limits<std::size_t>::max();
  double min_score = 0.0;  ///< Least score of a result, which also shares a word with the query.
  std::size_t max_matches = std::numeric_limits<std::size_t>::max();
};

/// Inverted index of images by their words, for finding the most similar images.
///
/// score(), see bag_of_words.hpp, needs only the words that two images share. A query sums
/// min(v_i, w_i) per image over the postings of its words. The time is linear in the number of
/// these postings and does not depend on thresholds. Const members are thread-safe.
class BowDatabase {
 public:
  /// For vectors of a vocabulary of `words` words.
  explicit BowDatabase(std::size_t words) : postings_(words) {}

  /// Adds an image and returns its index, counted from 0. Throws std::invalid_argument if words are
  /// not ascending or not in the vocabulary, if weights are not positive and finite, or if the
  /// numbers of words and weights differ. The state is then unchanged.
  std::size_t add(const BowVector& vector);

  /// The best images, by descending score, then ascending index. Precondition: `vector` would be
  /// accepted by add().
  [[nodiscard]] std::vector<BowMatch> query(const BowVector& vector,
                                            const BowQuery& query = {}) const;

  /// Number of images.
  std::size_t size() const { return size_; }

 private:
  struct Posting {
    std::uint32_t image;
    float weight;
  };
  // Scores of images [0, last) against `vector`.
  std::vector<float> accumulate(const BowVector& vector, std::size_t last) const;

  std::vector<std::vector<Posting>> postings_;  // postings of each word, ascending by image
  std::size_t size_ = 0;
};

}  // namespace km
