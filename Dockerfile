# Two images from one recipe, both with the versions pinned in constraints.txt and an unprivileged user:
#   docker build -t dob-companion .                            the demo: design, simulated flight, report
#   docker build -t dob-companion-daemon --target daemon .     what flies: numpy, pymavlink, pyserial, nothing that designs
# docs/install.md says how to run them.

FROM python:3.12-slim AS build-daemon
WORKDIR /source
COPY . .
# The environment has no pip of its own: the one of this stage fills it and stays behind. Byte code is made only of what the
# daemon imports: it uses one of pymavlink's forty MAVLink dialects.
RUN python -m pip wheel --quiet --no-cache-dir --no-deps --wheel-dir /wheel . \
 && python -m venv --without-pip /opt/dob-companion \
 && python -m pip --python /opt/dob-companion/bin/python install --quiet --no-cache-dir --no-compile \
      --constraint constraints.txt /wheel/*.whl \
 && /opt/dob-companion/bin/python -c 'import dob_companion.cli.daemon'

FROM build-daemon AS build-demo
RUN python -m pip --python /opt/dob-companion/bin/python install --quiet --no-cache-dir \
      --constraint constraints.txt "$(echo /wheel/*.whl)[demo]"

FROM python:3.12-slim AS runtime
RUN useradd --system --groups dialout --no-create-home --home-dir /tmp --uid 999 dob \
 && install --directory --owner=dob --group=dob /data
# Log lines reach `docker logs` at once. Caches have a place that any user may write to, as with `docker run --user`.
ENV PATH=/opt/dob-companion/bin:$PATH PYTHONUNBUFFERED=1 HOME=/tmp
WORKDIR /data
USER dob
ENTRYPOINT ["dob-companion"]

FROM runtime AS daemon
COPY --from=build-daemon /opt/dob-companion /opt/dob-companion
CMD ["run", "--design", "/data/design.json"]

FROM runtime AS demo
COPY --from=build-demo /opt/dob-companion /opt/dob-companion
VOLUME /data
CMD ["demo", "--fast", "-o", "/data"]
