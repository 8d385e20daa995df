#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

#include <memory>
#include <stdexcept>

#include "runtime/dds/codec.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/qos.hpp"
#include "test/fuzz/all_messages.hpp"
#include "test/support/loopback_config.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// DDS's own reader of envelopes, with the input that it gets from the network.
class EnvelopeReader {
 public:
  EnvelopeReader()
      : domain_(loopback_config()),
        participant_(dds_create_participant(static_cast<dds_domainid_t>(domain_.config().domain),
                                            nullptr, nullptr),
                     "participant"),
        topic_(dds_create_topic(participant_.handle(), &km_wire_Envelope_desc, "envelopes", nullptr,
                                nullptr),
               "topic") {
    const DdsEntity reader(
        dds_create_reader(participant_.handle(), topic_.handle(), nullptr, nullptr), "reader");
    const DdsEntity writer(
        dds_create_writer(participant_.handle(), topic_.handle(), nullptr, nullptr), "writer");
    for (const std::size_t size : {0U, 4U, 300U}) {  // without padding: every octet is used
      Bytes content(size, 7);
      km_wire_Envelope envelope{
          .key = 5, .boot = 70, .number = 3, .version = 1, .robot = 2, .content = {}};
      borrow(envelope.content, content);
      check_dds(dds_write(writer.handle(), &envelope), "write");
      ddsi_serdata* taken = nullptr;
      dds_sample_info_t info{};
      if (dds_takecdr(reader.handle(), &taken, 1, &info, DDS_ANY_STATE) != 1)
        throw std::runtime_error("an envelope does not reach its reader");
      Bytes bytes(ddsi_serdata_size(taken));
      ddsi_serdata_to_ser(taken, 0, bytes.size(), bytes.data());
      type_ = taken->type;
      ddsi_serdata_unref(taken);
      samples_.push_back(std::move(bytes));
    }
  }

  [[nodiscard]] const std::vector<Bytes>& samples() const { return samples_; }

  [[nodiscard]] bool accepts(std::span<const std::uint8_t> bytes) const {
    // DDS drops messages shorter than the header of their encoding before this.
    constexpr std::size_t kHeader = 4;
    if (bytes.size() < kHeader) return false;
    const ddsrt_iovec_t whole{const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
    ddsi_serdata* serialized = ddsi_serdata_from_ser_iov(type_, SDK_DATA, 1, &whole, bytes.size());
    if (serialized == nullptr) return false;
    km_wire_Envelope envelope{};
    const bool usable = ddsi_serdata_to_sample(serialized, &envelope, nullptr, nullptr);
    if (usable) read(envelope);
    dds_sample_free(&envelope, &km_wire_Envelope_desc, DDS_FREE_CONTENTS);
    ddsi_serdata_unref(serialized);
    return usable;
  }

 private:
  // Reads every octet, so that a sanitizer sees an invalid one.
  static void read(const km_wire_Envelope& envelope) {
    volatile std::uint32_t sum = 0;
    for (std::uint32_t i = 0; i < envelope.content._length; ++i)
      sum = sum + envelope.content._buffer[i];
  }

  DdsDomain domain_;
  DdsEntity participant_;
  DdsEntity topic_;
  const ddsi_sertype* type_ = nullptr;
  std::vector<Bytes> samples_;
};

}  // namespace

MessageReader envelope_messages() {
  const auto reader = std::make_shared<const EnvelopeReader>();
  return {"envelopes",
          [reader](std::span<const std::uint8_t> bytes) { return reader->accepts(bytes); },
          reader->samples()};
}

}  // namespace km
