#include "runtime/dds/qos.hpp"

#include <array>
#include <cmath>

namespace km {
namespace {

dds_duration_t nanoseconds_of(double seconds) {
  return static_cast<dds_duration_t>(std::llround(seconds * 1e9));
}

}  // namespace

const char* to_string(TrafficCategory category) {
  constexpr std::array kNames = {"place_recognition", "geometric_verification", "pgo", "map",
                                 "other"};
  return kNames.at(static_cast<std::size_t>(category));
}

DdsQos make_writer_qos(TopicKind kind, const DdsConfig& config) {
  DdsQos owner = make_dds_qos();
  dds_qos_t* qos = owner.get();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_writer_data_lifecycle(qos, false);  // an orderly exit does not dispose of published
                                               // samples
  dds_qset_ignorelocal(qos, DDS_IGNORELOCAL_PARTICIPANT);

  if (kind == TopicKind::kStatus) {
    dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
    dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
    dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, nanoseconds_of(config.liveliness_s));
    return owner;
  }

  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  // Robots that join later receive this history; the history above does not apply to them.
  dds_qset_durability_service(qos, 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  // A volatile request would be lost if it were the first to its addressee and overtook the
  // discovery of its writer. A lifespan bounds its age. DDS measures it from the arrival, so that
  // the clocks of the robots need not agree.
  if (kind == TopicKind::kRequest) dds_qset_lifespan(qos, nanoseconds_of(config.lease_s));
  return owner;
}

DdsQos make_reader_qos(TopicKind kind, const DdsConfig& config) {
  DdsQos qos = make_writer_qos(kind, config);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
  return qos;
}

}  // namespace km
