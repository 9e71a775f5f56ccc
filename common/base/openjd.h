// Lines by which a task tells the farm manager that runs it how it goes: OpenCue, Deadline and others read them from
// its standard output. Open Job Description, "How Jobs Are Run", "Stdout/Stderr Messages".
#pragma once

#include <string>
#include <string_view>

namespace lightmill {

/// "openjd_progress: 12.5"; of what is done, in [0, 1].
std::string openjd_progress(double fraction);
/// "openjd_status: ...", on one line.
std::string openjd_status(std::string_view text);
/// "openjd_fail: ...", on one line: why the task has failed.
std::string openjd_fail(std::string_view text);

/// From now on what the program's log says, but for details, stands on standard output too, as the task's status.
void log_as_openjd_status();

}  // namespace lightmill
