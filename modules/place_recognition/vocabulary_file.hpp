#pragma once

#include <filesystem>
#include <string>

#include "modules/place_recognition/vocabulary.hpp"

namespace km {

// Format, little-endian, no padding:
//   offset  size  content
//        0     8  "KMVOCAB" and a zero byte
//        8     4  format version, 1
//       12     4  branching k
//       16     4  depth L
//       20     4  N, nodes with the root
//       24     4  W, words
//       28     4  zero
//       32     8  fingerprint of k, L and all that follows, see vocabulary.hpp
//       40     N  children per node
//     40+N  32 (N-1)  centres of nodes 1 to N-1
//       ...  4 W  idf per word, float

/// The bytes of the file of `data`.
[[nodiscard]] std::string serialize(const VocabularyData& data);

/// Reads the result of serialize(). `name` appears in messages. Throws std::runtime_error that
/// states the error and its offset: truncated or overlong, other format or version, sizes that do
/// not fit the file, wrong checksum, or an invalid tree. Sizes are compared with `bytes` before
/// memory is allocated.
[[nodiscard]] VocabularyData deserialize(const std::string& bytes, const std::string& name);

/// Throw std::runtime_error with the path if the file cannot be read or written, or is invalid.
[[nodiscard]] Vocabulary load_vocabulary(const std::filesystem::path& path);
void save_vocabulary(const VocabularyData& data, const std::filesystem::path& path);

}  // namespace km
