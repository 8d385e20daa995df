# A manual page for each of ${programs} in ${bin}, from its --help.
foreach(program ${programs})
  execute_process(COMMAND ${bin}/${program} --help OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE "\\" "\\e" text "${text}")
  string(REPLACE "-" "\\-" text "${text}")
  string(REGEX REPLACE "(^|\n)([.'])" "\\1\\\\&\\2" text "${text}")
  string(REGEX MATCH "^[^.]*" about "${text}")  # the first sentence
  string(REPLACE "\n" " " about "${about}")
  file(WRITE "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/share/man/man1/${program}.1"
       ".TH ${program} 1\n.SH NAME\n${program} \\- ${about}\n.SH DESCRIPTION\n.nf\n${text}.fi\n")
endforeach()
