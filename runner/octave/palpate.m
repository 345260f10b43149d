% Drives `palpate serve` from Octave, through client.py, which also says that the program lives.
%
%   hand = palpate ("open", "token.json");                            % of palpate serve --token-file
%   palpate (hand, "start", struct ("stimulus", "ball", "trial", 1)); % returns once forces are on
%   trial = palpate (hand, "answer", struct ("response", "ball"));    % forces off, on record
%   palpate (hand, "close");
%
% Messages and answers: "Reference: messages of palpate serve" in runner/README.md. What is refused is an error whose
% identifier is palpate:CODE; an answer that came after the protocol's time gives the trial, with timed_out. hand.server is what the server said of itself.
function out = palpate (hand, kind, values = struct ())
  if (ischar (hand))
    here = fileparts (mfilename ("fullpath"));
    client = fullfile (here, "..", "python", "palpate", "client.py");
    [in, from, pid] = popen2 ("python3", {client, kind});
    out = struct ("in", in, "out", from, "pid", pid);
    out.server = answer_of (out);
    return;
  endif
  if (strcmp (kind, "close"))
    fclose (hand.in);
    fclose (hand.out);
    waitpid (hand.pid);
    return;
  endif
  values.type = kind;
  fprintf (hand.in, "%s\n", jsonencode (values));
  fflush (hand.in);
  out = answer_of (hand);
endfunction

function said = answer_of (hand)
  line = "";
  while (isempty (line) || line(end) != "\n")
    more = fgets (hand.out);  % what has come so far; -1: nothing
    if (ischar (more))
      line = [line, more];
    else
      [pid, status] = waitpid (hand.pid, WNOHANG ());
      if (pid != 0)
        error ("palpate:closed", "palpate: the server has gone");
      endif
      fclear (hand.out);
      pause (0.001);
    endif
  endwhile
  said = jsondecode (line);
  if (! said.ok && strcmp (said.error.code, "timed-out"))
    said = said.stored;  % as an answer: timed_out is true, response empty
  elseif (! said.ok)
    error (["palpate:", said.error.code], "palpate: %s", said.error.message);
  endif
endfunction
