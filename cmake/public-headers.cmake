# Writes the public headers to a folder, as programs and plugins include them ("strobe/core/math/math.h"), and abi.h, which
# has the hash of their text.
#   cmake -DSOURCE=src -DTARGET=include/strobe -DVERSION=0.2.0 -DHEADERS="core/math/math.h;…" -P public-headers.cmake
set(texts)
foreach(header ${HEADERS})
  file(READ ${SOURCE}/${header} text)
  # A bracket or a semicolon would end an element of a list; the text is not used as one.
  string(REGEX REPLACE "#include \"(core|materials)/" "#include \"strobe/\\1/" text "${text}")
  string(REGEX REPLACE "#include \"(api|loader/build)/" "#include \"strobe/" text "${text}")
  string(REGEX REPLACE "^(api|loader/build)/" "" name ${header})
  string(SHA256 hash "${text}")
  string(APPEND texts "${name} ${hash}\n")
  set(file ${TARGET}/${name})
  set(old)
  if(EXISTS ${file})
    file(READ ${file} old)
  endif()
  if(NOT "${text}" STREQUAL "${old}")
    file(WRITE ${file} "${text}")
  endif()
endforeach()
string(SHA256 hash "${texts}")
string(SUBSTRING ${hash} 0 16 HEADERS_HASH)
configure_file(${CMAKE_CURRENT_LIST_DIR}/abi.h.in ${TARGET}/abi.h @ONLY)
