# docker build -t forestrl .
# docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" forestrl train env.n_trees=75
#
# The mounted folder is the working folder: outputs/, multirun/ and the paths on the command line are
# those of this folder, as without Docker. Without -v, results stay in the container.

FROM python:3.11-slim-bookworm AS wheel
WORKDIR /src
COPY . .
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /dist . \
 && python -c "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['dependencies'], sep='\n')" > /dist/requirements.txt


FROM python:3.11-slim-bookworm
LABEL org.opencontainers.image.title="ForestRL" \
      org.opencontainers.image.licenses="MIT"

# Where torch comes from: the default index unless an extra one, such as that of the CPU or of a
# CUDA build, is given by --build-arg.
ARG TORCH="torch>=2.7,<2.14"
ARG PIP_EXTRA_INDEX_URL=""
# hadolint ignore=DL3013
RUN pip install --no-cache-dir "${TORCH}"

# The dependencies have a layer of their own: it outlives changes to the code.
COPY --from=wheel /dist/requirements.txt /dist/
RUN pip install --no-cache-dir --requirement /dist/requirements.txt
COPY --from=wheel /dist/*.whl /dist/
RUN pip install --no-cache-dir --no-deps /dist/*.whl && pip check

# Every writable place is writable for any --user. USER names the user for libraries that ask, since
# a chosen id has no entry in /etc/passwd.
ENV HOME=/home/forestrl \
    USER=forestrl \
    MPLBACKEND=Agg \
    MPLCONFIGDIR=/home/forestrl/matplotlib \
    NUMBA_CACHE_DIR=/home/forestrl/numba \
    PYTHONUNBUFFERED=1
WORKDIR /work

# Compile the kernels and list the fonts once, here, and not at the start of every container.
RUN mkdir --parents "${MPLCONFIGDIR}" "${NUMBA_CACHE_DIR}" \
 && forestrl train experiment=smoke hydra.run.dir=/tmp/smoke \
 && python -c "import matplotlib.font_manager" \
 && rm -rf /tmp/smoke /work/* \
 && chmod -R a+rwX "${HOME}" /work

COPY docker/entrypoint.sh /usr/local/bin/entrypoint
USER 10001:10001
ENTRYPOINT ["entrypoint"]
CMD ["--help"]
