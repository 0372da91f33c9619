// $plant_edge(gates) for bench.v: one edge of the plant a call, gates in, pins out.

#include <vpi_user.h>

#include "plant.hpp"

namespace {

PLI_INT32 plant_edge(PLI_BYTE8*) {
  static Plant<double> plant;
  const vpiHandle call = vpi_handle(vpiSysTfCall, nullptr);
  const vpiHandle arguments = vpi_iterate(vpiArgument, call);
  s_vpi_value value{};
  value.format = vpiIntVal;
  vpi_get_value(vpi_scan(arguments), &value);
  vpi_free_object(arguments);
  const PLI_INT32 gates = value.value.integer;
  plant.drive(gates & 1, gates & 2, gates & 4, gates & 8);
  plant.flow();
  value.value.integer = plant.a() + 2 * plant.b();
  vpi_put_value(call, &value, nullptr, vpiNoDelay);
  return 0;
}

void offer() {
  s_vpi_systf_data task{};
  task.type = vpiSysFunc;
  task.sysfunctype = vpiIntFunc;
  task.tfname = "$plant_edge";
  task.calltf = plant_edge;
  vpi_register_systf(&task);
}

}  // namespace

extern "C" {
void (*vlog_startup_routines[])() = {offer, nullptr};
}
