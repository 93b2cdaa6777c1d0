# cmake -DFILE=x.json -DKEYS="frames;stages.mesh.p50_ms" -P JsonGet.cmake: the values, separated by commas; "-" for one
# that is null or not there. For scripts: CMake reads JSON and is there wherever Burin was built.
file(READ "${FILE}" json)
set(values)
foreach(key IN LISTS KEYS)
  string(REPLACE "." ";" path "${key}")
  string(JSON value ERROR_VARIABLE error GET "${json}" ${path})
  if(error OR "${value}" STREQUAL "")  # a null has no text
    set(value "-")
  endif()
  list(APPEND values "${value}")
endforeach()
list(JOIN values "," line)
execute_process(COMMAND ${CMAKE_COMMAND} -E echo "${line}")
