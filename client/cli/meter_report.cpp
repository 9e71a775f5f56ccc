#include "client/cli/meter_report.h"

#include "common/base/number_text.h"

namespace lightmill::cli {

std::string reading_text(const NamedReading& reading) {
  const MeterReading& r = reading.reading;
  if (r.samples == 0) {
    return "no samples yet";
  }
  return fmt::format("{} {}, {} {}", interval_text(r.value, r.half_width), radiometric_unit(reading.meter),
                     interval_text(r.photometric, r.photometric_width), photometric_unit(reading.meter));
}

}  // namespace lightmill::cli
