#include <catch2/catch.hpp>
#include <limits>
#include <string>

#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_codec.hpp"
#include "test/modules/mesh/wavy_sheet.hpp"

namespace km {
namespace {

MeshChunk some_chunk() {
  return split_mesh(wavy_sheet(20, 0.1), 700, 3, {}).chunks.at(1);
}

// As it arrives: with the writer's header.
Codec<MeshChunk>::Encoded received(const MeshChunk& chunk) {
  auto encoded = Codec<MeshChunk>::encode(chunk);
  encoded.wire.header.robot = chunk.key.robot;
  encoded.wire.header.boot = 12345;
  return encoded;
}

TEST_CASE("A mesh chunk survives the wire", "[codec]") {
  MeshChunk chunk = some_chunk();
  SECTION("with labels") {}
  SECTION("without labels") {
    chunk.labels.clear();
  }
  SECTION("empty: no more") {
    chunk = {.key = chunk.key};
  }
  SECTION("far away") {
    chunk.origin = {-(1 << 30), 1 << 30, 0};
  }
  const auto encoded = received(chunk);
  const Decoded<MeshChunk> decoded = Codec<MeshChunk>::decode(encoded.wire);
  REQUIRE(decoded.value);
  chunk.boot = 12345;
  CHECK(*decoded.value == chunk);
}

TEST_CASE("The largest chunk survives the wire", "[codec]") {
  const MeshPieces pieces = split_mesh(wavy_sheet(180, 0.01), 1, 1, {});
  std::size_t largest = 0;
  for (const MeshChunk& chunk : pieces.chunks) {
    largest = std::max(largest, wire_bytes(chunk));
    CHECK(Codec<MeshChunk>::decode(received(chunk).wire).value);
  }
  CHECK(largest > kMaxChunkBytes - 50);
}

TEST_CASE("A mesh chunk that cannot be is refused", "[codec]") {
  MeshChunk chunk = some_chunk();
  auto encoded = received(chunk);
  km_wire_MeshChunk& wire = encoded.wire;
  std::string reason = "elements are missing or too many";
  SECTION("of another robot") {
    wire.header.robot = 4;
    reason = "the mesh of another robot than the writer";
  }
  SECTION("offsets claimed without being there") {
    wire.offsets._buffer = nullptr;
  }
  SECTION("labels claimed without being there") {
    wire.labels._buffer = nullptr;
  }
  SECTION("faces claimed without being there") {
    wire.faces._buffer = nullptr;
  }
  SECTION("offsets without end") {
    wire.offsets._length = 0xffffffffU;
  }
  SECTION("labels without end") {
    wire.labels._length = 0xffffffffU;
  }
  SECTION("faces without end") {
    wire.faces._length = 0xffffffffU;
  }
  SECTION("half a vertex") {
    --wire.offsets._length;
    reason = "offsets or faces are not triples";
  }
  SECTION("half a face") {
    --wire.faces._length;
    reason = "offsets or faces are not triples";
  }
  SECTION("a label too few") {
    --wire.labels._length;
    reason = "labels do not fit the vertices";
  }
  SECTION("too large") {
    chunk.faces.resize(6000, {0, 1, 2});
    encoded = received(chunk);
    reason = "a chunk that is too large";
  }
  SECTION("a face outside") {
    encoded.faces.back() = static_cast<std::uint16_t>(chunk.offsets.size());
    reason = "a face names a vertex which does not exist";
  }
  SECTION("vertices for nothing") {
    wire.faces._length = 0;
    reason = "vertices without faces";
  }
  SECTION("positions") {
    reason = "positions are not finite or too far away";
    SECTION("steps that are no number") {
      wire.step_m = std::numeric_limits<float>::quiet_NaN();
    }
    SECTION("no steps") {
      wire.step_m = 0.0F;
    }
    SECTION("endless steps") {
      wire.step_m = std::numeric_limits<float>::infinity();
    }
    SECTION("steps of light years") {
      wire.step_m = 1e16F;
    }
    SECTION("an origin at the end of all numbers") {
      wire.origin.y = std::numeric_limits<std::int32_t>::min();
    }
  }
  const Decoded<MeshChunk> decoded = Codec<MeshChunk>::decode(wire);
  CHECK_FALSE(decoded.value);
  CHECK(std::string(decoded.refusal == nullptr ? "" : decoded.refusal) == reason);
}

}  // namespace
}  // namespace km
