#pragma once

#include <ostream>

namespace km {

/// Standard output and standard error. A flush queues the text since the last one, and a thread
/// writes it, so that callers never wait for a terminal, a pipe or a disk. If too many texts wait,
/// the oldest ones are lost: "12 lines lost: output blocked or failed" stands in their place. The
/// order of both streams is kept. The program's end waits as drain_standard_output().
/// Each stream is for one thread at a time.
std::ostream& unblocked_stdout();
std::ostream& unblocked_stderr();

/// Waits until the queued text is written, at most 2 s.
void drain_standard_output();

}  // namespace km
