#pragma once

#include <dds/dds.h>
#include <envelope.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace km {

/// Bytes of an envelope (idl/envelope.idl) beside its content, DDS's encoding header included.
inline constexpr std::size_t kEnvelopeBytes = 32;

/// Bytes of an envelope as DDS sends it: the content is padded to a multiple of 4.
[[nodiscard]] constexpr std::size_t envelope_bytes(std::size_t content_bytes) {
  return kEnvelopeBytes + (content_bytes + 3) / 4 * 4;
}

/// The bytes of `wire`, a sample of the generated `type`: XCDR2, least significant byte first.
[[nodiscard]] std::vector<std::uint8_t> serialize(const dds_topic_descriptor_t& type,
                                                  const void* wire);

/// A sample of a generated type, read from untrusted bytes.
class WireSample {
 public:
  /// `type` outlives this. The sample is zero.
  explicit WireSample(const dds_topic_descriptor_t& type);
  ~WireSample();
  WireSample(const WireSample&) = delete;
  WireSample& operator=(const WireSample&) = delete;

  /// False if `bytes` are not one sample of the type, possibly with fields that later versions
  /// append; then the sample is of no use. Call once.
  [[nodiscard]] bool read(std::span<const std::uint8_t> bytes);

  [[nodiscard]] const void* get() const { return sample_.data(); }

 private:
  const dds_topic_descriptor_t& type_;
  std::vector<std::max_align_t> sample_;
};

}  // namespace km
