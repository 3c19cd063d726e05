// SPDX-License-Identifier: Apache-2.0
#include "tools/python/errors.h"

namespace toftwin::python {
namespace {

PyObject* error_class = nullptr;  // lives as long as the module, which is never unloaded

void raise(const Error& error) {
  const auto type = py::reinterpret_borrow<py::object>(error_class);
  py::object raised = type(error.message);
  raised.attr("code") = wordOf(error.code);
  PyErr_SetObject(error_class, raised.ptr());
}

}  // namespace

const char* wordOf(Error::Code code) {
  switch (code) {
    case Error::Code::Internal: return "internal";
    case Error::Code::InvalidArgument: return "invalid_argument";
    case Error::Code::NotFound: return "not_found";
    case Error::Code::Unsupported: return "unsupported";
    case Error::Code::Malformed: return "malformed";
    case Error::Code::TooLarge: return "too_large";
    case Error::Code::Timeout: return "timeout";
    case Error::Code::Disconnected: return "disconnected";
    case Error::Code::Busy: return "busy";
    case Error::Code::PermissionDenied: return "permission_denied";
    case Error::Code::StorageFull: return "storage_full";
    case Error::Code::EndOfStream: return "end_of_stream";
    case Error::Code::Stopped: return "stopped";
    case Error::Code::Overrun: return "overrun";
    case Error::Code::Incompatible: return "incompatible";
  }
  return "internal";
}

void defineErrors(py::module_& module) {
  error_class = PyErr_NewExceptionWithDoc(
      "toftwin.Error",
      "Something that a correct program may meet: what, where, and what to do about it.\n\n"
      "`code` is a word for programs, such as \"not_found\", \"timeout\", \"busy\" or \"permission_denied\".",
      PyExc_RuntimeError, nullptr);
  module.add_object("Error", py::reinterpret_borrow<py::object>(error_class));
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Thrown& e) {
      raise(e.error);
    }
  });
}

}  // namespace toftwin::python
