// SPDX-License-Identifier: MIT
#include "api/source_handles.h"

namespace burin {

SourceTable& sources() {
    static SourceTable table;
    return table;
}

RecorderTable& recorders() {
    static RecorderTable table;
    return table;
}

char* source_thread_error() {
    static thread_local char text[512] = "";
    return text;
}

}  // namespace burin
